// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace tendon {

/// The reasons why a force differs from the demand. Part of the wire format and recordings: never renumber.
enum class Reason : std::uint32_t {
  kNone = 0,
  kEnergy = 1U << 0,         ///< output limiter: a larger force could break passivity
  kMaxForce = 1U << 1,       ///< force limit of the device or the scene
  kSlew = 1U << 2,           ///< slew rate limit
  kRampIn = 1U << 3,         ///< ramp after (re-)engaging
  kHeld = 1U << 4,           ///< the remote force has expired and is still held
  kDecaying = 1U << 5,       ///< the remote force is fading out
  kSafeStop = 1U << 6,       ///< no remote force until a new one arrives
  kNotFinite = 1U << 7,      ///< NaN or infinity in the demand or a measurement
  kFault = 1U << 8,          ///< the force is zero until the fault is cleared
  kDeviceClamp = 1U << 9,    ///< the device applied less than the commanded force
  kOverrun = 1U << 10,       ///< the last interval was longer than longest_hold (this does not limit the force)
  kWatchdog = 1U << 11,      ///< the last interval was longer than the watchdog (this does not limit the force)
  kUnseen = 1U << 12,        ///< no position was measured, so the force is zero
  kDisarmed = 1U << 13,      ///< the device was disarmed by the operator
  kDamped = 1U << 14,        ///< damper of the output limiter: the hand vibrates in contact
  kAcceleration = 1U << 15,  ///< the hand exceeded bounded_acceleration, so this step uses the plain bound
};

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

/// Returns a list such as "energy, slew", or an empty string if there are none.
std::string to_string(Reasons reasons);

}  // namespace tendon
