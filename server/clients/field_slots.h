// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/field/brick_field.h"
#include "core/field/field.h"
#include "protocol/field/manifest.h"
#include "server/mailboxes.h"

namespace tendon {

/// Passes the fields of one channel to the haptic thread, which only receives pointers. A field does not change while
/// the haptic thread can use it. One of the kCount slots contains the field in use, one contains the posted field that
/// the haptic thread takes in its next step, and the last one is free for the next field. If several fields are
/// requested within a step, the newest one wins.
/// Only the constructor allocates the memory of bricks. Thread-safe: no. Realtime-safe: no.
class FieldSlots {
 public:
  static constexpr std::size_t kCount = 3;
  static std::size_t memory() noexcept { return kCount * field::BrickField::memory(); }  ///< bytes

  using Fill = std::function<void(field::BrickField&)>;

  explicit FieldSlots(FieldBox& box) noexcept : box_(box) {}

  /// Prepares a field, which is posted by the next turn(). `field.bricks` is ignored: `fill` builds the bricks with the
  /// name `bricks`, unless they are in a slot already. If `bricks` is empty, the field has none.
  void use(field::Field field, const std::optional<FieldName>& bricks, const Fill& fill, std::uint32_t generation,
           std::uint32_t source);
  void stop();  ///< the channel no longer uses a field

  /// Passes on a pose. It is repeated with the next field of the source, which may arrive later.
  void move(const ArrivedPose& pose);

  /// Must be called after a step of the haptic thread. Fields of a source other than `holder` are not posted. If one is
  /// in use, it is stopped, because the haptic thread may not have been told that its source has left (Leases::give).
  void turn(std::uint32_t holder);

  bool has(const FieldName& bricks) const noexcept;  ///< true if use() does not call `fill`

 private:
  struct Shape {
    field::BrickField bricks;
    std::optional<FieldName> name;
  };
  struct Slot {
    field::Field field;
    FieldUse use{};
    const Shape* shape = nullptr;
  };

  Slot& prepare();
  Shape& shape_for(const FieldName& name, const Fill& fill);

  FieldBox& box_;
  std::array<Shape, kCount> shapes_;
  std::array<Slot, kCount> slots_;
  std::uint32_t number_ = 0;       ///< of the newest posted field
  const Slot* posted_ = nullptr;   ///< the slot of this field
  const Slot* used_ = nullptr;     ///< the slot of the field before, or the same if the haptic thread has taken it
  const Slot* waiting_ = nullptr;  ///< the slot of the field to post next, or null
  std::optional<ArrivedPose> pose_;
};

}  // namespace tendon
