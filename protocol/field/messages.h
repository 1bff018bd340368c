// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <tuple>

#include "core/base/expect.h"
#include "core/base/time.h"
#include "protocol/field/manifest.h"
#include "protocol/field/pace.h"
#include "protocol/messages.h"

// The messages of an upload (OfferField, FieldBrick, FieldStatus) are generated from tendon.proto.

namespace tendon {

/// The bit of FieldStatus::missing for the manifest.
inline constexpr std::size_t kManifestBit = field::BrickField::kMostBricks;
static_assert(kManifestBit / 8 == std::tuple_size_v<decltype(FieldStatus::missing)> - 1);

inline bool misses(const FieldStatus& status, std::size_t i) noexcept {
  return (status.missing[i / 8] >> (i % 8) & std::byte{1}) != std::byte{};
}
inline void miss(FieldStatus& status, std::size_t i) noexcept { status.missing[i / 8] |= std::byte{1} << (i % 8); }
inline bool is_complete(const FieldStatus& status) noexcept {
  return std::ranges::all_of(status.missing, [](std::byte bits) { return bits == std::byte{}; });
}

/// Limits the rate of bricks.
class BrickPace : public Pace {
 public:
  /// Throws std::invalid_argument if `bytes_per_s` is not in 1 … 1e9, or if `burst` is negative.
  BrickPace(double bytes_per_s, Duration burst) : Pace(interval_at(bytes_per_s), burst) {}

 private:
  static Duration interval_at(double bytes_per_s) {
    expect(bytes_per_s >= 1 && bytes_per_s <= 1e9, "bytes_per_s", bytes_per_s, "1 … 1e9");
    return from_seconds(limits::kBrickBytes / bytes_per_s);
  }
};

}  // namespace tendon
