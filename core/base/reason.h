// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace tendon {

/// Why the force is not the one that was asked for. Every limiter returns one with its result.
/// The values are bits, part of the wire and of recordings: never renumber.
enum class Reason : std::uint32_t {
  kNone = 0,
  kEnergy = 1U << 0,       ///< the output limiter: more would let the device give out energy it never got
  kMaxForce = 1U << 1,     ///< the device's or the scene's force limit
  kSlew = 1U << 2,         ///< the force may not grow that fast
  kRampIn = 1U << 3,       ///< forces have just (re-)engaged
  kHeld = 1U << 4,         ///< the remote force has outlived its validity and is held
  kDecaying = 1U << 5,     ///< the remote force fades
  kSafeStop = 1U << 6,     ///< the remote force is zero until a fresh one comes
  kNotFinite = 1U << 7,    ///< NaN or infinity was asked for or measured
  kFault = 1U << 8,        ///< a latched fault holds the force at zero
  kDeviceClamp = 1U << 9,  ///< the device wrote less than it was told to
  kOverrun = 1U << 10,     ///< not a limit: the force before was held for longer than the scene's longest_hold
  kWatchdog = 1U << 11,    ///< not a limit: and for so long that the device's own watchdog ended it
  kUnseen = 1U << 12,      ///< the device gave no position this time, so no force is given out
  kDisarmed = 1U << 13,    ///< the operator has disarmed the device: no force until it is rearmed
  kDamped = 1U << 14,      ///< the output limiter's damper: the hand vibrates in contact
  /// Not a limit: the hand accelerated harder than bounded_acceleration counts on, so this step counts on friction alone.
  kAcceleration = 1U << 15,
};

/// A set of reasons.
class Reasons {
 public:
  constexpr Reasons() noexcept = default;
  constexpr Reasons(Reason r) noexcept : bits_(static_cast<std::uint32_t>(r)) {}  // NOLINT(google-explicit-constructor)
  static constexpr Reasons from_bits(std::uint32_t bits) noexcept {
    Reasons r;
    r.bits_ = bits;
    return r;
  }

  constexpr Reasons& operator|=(Reasons other) noexcept {
    bits_ |= other.bits_;
    return *this;
  }
  constexpr bool has(Reason r) const noexcept { return (bits_ & static_cast<std::uint32_t>(r)) != 0; }
  constexpr bool empty() const noexcept { return bits_ == 0; }
  constexpr std::uint32_t bits() const noexcept { return bits_; }
  constexpr bool operator==(const Reasons&) const noexcept = default;

 private:
  std::uint32_t bits_ = 0;
};

/// "energy, slew": for people. Empty for no reason.
std::string to_string(Reasons reasons);

}  // namespace tendon
