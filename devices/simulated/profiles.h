// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger/friction.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// How a number came to be known, the most trustworthy first.
enum class Provenance {
  kMeasured,  ///< identified on a real device, by us
  kQuoted,    ///< read in the source named, or computed from what is printed there
  kRecalled,  ///< quoted from memory of the source named: check it before you rely on it
  kAssumed,   ///< a guess; the note says why this one
};

std::string_view to_string(Provenance provenance) noexcept;

/// A number and how it came to be known.
struct KnownNumber {
  double value;
  Provenance provenance;
  std::string_view note;  ///< source, or reason
};

/// The numbers of a real device, for a simulated device like it. They are start values and claim nothing about one
/// particular unit; before a limiter runs on hardware, identify the friction of that unit.
struct DeviceProfile {
  std::string_view name;
  KnownNumber mass;                     ///< kg
  KnownNumber viscous_friction;         ///< N·s/m
  KnownNumber coulomb_friction;         ///< N
  KnownNumber encoder_step;             ///< m
  KnownNumber max_force;                ///< N
  KnownNumber amplifier_bandwidth;      ///< Hz
  std::optional<KnownNumber> watchdog;  ///< s; empty for a device without one
  KnownNumber viscous_bound;            ///< N·s/m, for the limiter
  KnownNumber coulomb_bound;            ///< N, for the limiter

  /// The simulated device, without a hand. Its `info()` has the numbers of the data sheet.
  SimulatedDevice::Config device() const;
  /// The friction that the limiter may count on: never above the friction of the device.
  Friction friction_bounds() const noexcept { return {.coulomb = coulomb_bound.value, .viscous = viscous_bound.value}; }
};

/// All device profiles: phantom-premium, touch, falcon.
std::span<const DeviceProfile> device_profiles() noexcept;

/// The profile of that name, or null.
const DeviceProfile* find_device_profile(std::string_view name) noexcept;

/// The two values between which a number lies, and how that came to be known.
struct KnownRange {
  double least;
  double most;
  Provenance provenance;
  std::string_view note;  ///< source, or reason

  /// Half way: the value to use when nothing else is known.
  double middle() const noexcept { return least + (most - least) / 2; }
};

/// The numbers of a finger, hand or arm that holds the handle, for a simulated hand like it. Each number is a range,
/// because people differ, and because a harder grip is stiffer. A spring, a damper and a mass are the simplest model
/// that tells a hand from a wall; it is wrong above some 50 Hz, and when the grip force is close to zero.
struct OperatorProfile {
  std::string_view name;
  KnownRange stiffness;  ///< N/m
  KnownRange damping;    ///< N·s/m
  KnownRange mass;       ///< kg

  /// The hand in the middle of all three.
  OperatorHand::Config hand(ScriptedMotion motion) const;
};

/// All operator profiles: fingertip, stylus, arm.
std::span<const OperatorProfile> operator_profiles() noexcept;

/// The profile of that name, or null.
const OperatorProfile* find_operator_profile(std::string_view name) noexcept;

/// A heavy device of admittance type, without a hand: 2 kg, 20 N·s/m, 1 N, a force sensor, no other effect. It is no
/// real device: control.md 1.5 tried the admittance form of the limiter with these numbers.
SimulatedDevice::Config admittance_device();

/// Every number of the profile, one per line: what, value with unit, provenance, source.
std::string provenance_table(const DeviceProfile& profile);
std::string provenance_table(const OperatorProfile& profile);

}  // namespace tendon
