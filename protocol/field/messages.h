// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/expect.h"
#include "core/base/time.h"
#include "protocol/field/manifest.h"

// The messages of an upload as plain values. The spans refer to the memory of the sender, or to the datagram.

namespace tendon {

/// client → server, reliable and in order: bytes offset … offset + bytes.size() − 1 of a manifest of `size` bytes.
struct FieldPart {
  FieldName field{};
  std::uint32_t size = 0;
  std::uint32_t offset = 0;
  std::span<const std::byte> bytes{};  ///< at most limits::kMaxFieldPart
};

/// client → server, unreliable.
struct FieldBrick {
  BrickHash hash{};
  std::span<const std::byte> bytes{};  ///< limits::kBrickBytes
};

/// server → client, unreliable, 20 times per second; the newest one wins. Bit i % 8 of byte i / 8 is set if brick i is
/// missing. The last bit is set if the manifest is not complete. In this case, the bits of unknown bricks are 0.
struct FieldStatus {
  static constexpr std::size_t kManifest = field::BrickField::kMostBricks;

  FieldName field{};
  std::array<std::byte, 128> missing{};

  bool misses(std::size_t i) const noexcept { return (missing[i / 8] >> (i % 8) & std::byte{1}) != std::byte{}; }
  void miss(std::size_t i) noexcept { missing[i / 8] |= std::byte{1} << (i % 8); }
  bool complete() const noexcept {
    return std::ranges::all_of(missing, [](std::byte bits) { return bits == std::byte{}; });
  }
};

/// Limits the rate of bricks (the generic cell rate algorithm of ATM, ITU-T I.371).
class BrickPace {
 public:
  /// Up to `burst` can be sent at once after a pause. Throws std::invalid_argument if `bytes_per_s` is not in
  /// 1 … 1e9, or if `burst` is negative.
  BrickPace(double bytes_per_s, Duration burst) : burst_(burst) {
    expect(bytes_per_s >= 1 && bytes_per_s <= 1e9, "bytes_per_s", bytes_per_s, "1 … 1e9");
    expect_not_negative(seconds(burst), "burst_s");
    interval_ = from_seconds(limits::kBrickBytes / bytes_per_s);
  }

  LocalTime next() const noexcept { return next_; }
  /// Returns false if the rate is exceeded.
  bool pass(LocalTime now) noexcept {
    if (next_ > now) return false;
    next_ = std::max(next_, now - burst_) + interval_;
    return true;
  }

 private:
  Duration interval_{};
  Duration burst_;
  LocalTime next_{};
};

}  // namespace tendon
