// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "protocol/field/messages.h"

namespace tendon {

/// Uploads a field to a server. It sends the manifest, waits for a status, and sends the missing bricks at a limited
/// rate. If a brick was sent more than a round trip before a status and is still missing, it is lost and has the highest
/// priority. If the server already has all bricks, only the manifest is sent.
/// Only the constructor and next_part() allocate memory. Thread-safe: no. Realtime-safe: yes, except these two.
class FieldSender {
 public:
  struct Brick {
    std::array<std::int32_t, 3> place{};
    std::uint8_t material = 0;
    BrickBytes bytes{};
  };
  struct Config {
    double bytes_per_s = 500e3;
    Duration burst = std::chrono::milliseconds(33);  ///< sufficient for a loop of 30 Hz
    /// If no status is received for this time, the manifest is sent again. The server may have dropped it.
    Duration silence = std::chrono::seconds(2);
  };

  /// `bricks` must remain valid; there can be none if there is a primitive. Throws std::invalid_argument as encode_manifest(), or if a number of `config` is not
  /// positive.
  FieldSender(const Config& config, const FieldLattice& lattice, std::span<const Brick> bricks,
              std::span<const field::Primitive> primitives = {});

  const FieldName& field() const noexcept { return field_; }
  std::span<const std::byte> manifest() const noexcept { return manifest_; }

  /// Returns the next part of the offer, or nullopt if all were sent. Call part_sent() if the session has accepted it.
  std::optional<OfferField> next_part(LocalTime now);
  void part_sent() noexcept;

  /// `round_trip` is the smoothed round trip of the session. Returns false if this is the status of another field.
  bool take(LocalTime now, const FieldStatus& status, Duration round_trip) noexcept;

  /// Returns the next brick if it is due. The bytes are not copied.
  std::optional<FieldBrick> next_brick(LocalTime now) noexcept;
  /// Returns when to call next_part() and next_brick() if no status arrives before.
  LocalTime due() const noexcept;

  bool complete() const noexcept { return complete_; }   ///< according to the newest status
  std::uint64_t sent() const noexcept { return sent_; }  ///< bricks, with repetitions

 private:
  static constexpr LocalTime kNever = LocalTime::min();

  std::optional<std::size_t> choice() const noexcept;

  Config config_;
  std::span<const Brick> bricks_;
  std::vector<std::byte> manifest_;
  FieldName field_{};
  std::size_t offered_ = 0;  ///< bytes of the manifest
  std::optional<FieldStatus> status_;
  LocalTime heard_ = kNever;           ///< time of the newest status
  LocalTime arrived_before_ = kNever;  ///< bricks sent before this time are lost if they are missing
  std::vector<LocalTime> sent_at_;
  BrickPace pace_;
  bool complete_ = false;
  std::uint64_t sent_ = 0;
};

}  // namespace tendon
