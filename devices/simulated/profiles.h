// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger/friction.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// How a number came to be known. In this order of trust.
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

/// A real device's numbers, for a simulated device that is like it. These are start values and make no
/// claim about any one unit; before a limiter runs on hardware, identify that unit's friction.
struct DeviceProfile {
  std::string_view name;
  KnownNumber mass;                     ///< kg
  KnownNumber viscous_friction;         ///< N·s/m
  KnownNumber coulomb_friction;         ///< N
  KnownNumber encoder_step;             ///< m
  KnownNumber max_force;                ///< N
  KnownNumber amplifier_bandwidth;      ///< Hz
  std::optional<KnownNumber> watchdog;  ///< s; a device without one has none here
  KnownNumber viscous_bound;            ///< N·s/m, for the limiter
  KnownNumber coulomb_bound;            ///< N, for the limiter

  /// The simulated device, without a hand. Its `info()` has the data-sheet numbers.
  SimulatedDevice::Config device() const;
  /// What the limiter may count on: never above the friction that the device has.
  Friction friction_bounds() const noexcept { return {.coulomb = coulomb_bound.value, .viscous = viscous_bound.value}; }
};

/// All of them: phantom-premium, touch, falcon.
std::span<const DeviceProfile> device_profiles() noexcept;

/// The one of that name, or null.
const DeviceProfile* find_device_profile(std::string_view name) noexcept;

/// Between which two values a number lies, and how that came to be known.
struct KnownRange {
  double least;
  double most;
  Provenance provenance;
  std::string_view note;  ///< source, or reason

  /// Half way: what a hand has of which no more is known.
  double middle() const noexcept { return least + (most - least) / 2; }
};

/// What holds the handle, for a simulated hand that is like it. Each number is a range, because people differ, and
/// because whoever grips harder is stiffer. A spring, a damper and a mass are the least that tells a hand from a wall;
/// they miss what a hand does above some 50 Hz, and at next to no grip force.
struct OperatorProfile {
  std::string_view name;
  KnownRange stiffness;  ///< N/m
  KnownRange damping;    ///< N·s/m
  KnownRange mass;       ///< kg

  /// The hand in the middle of all three.
  OperatorHand::Config hand(ScriptedMotion motion) const;
};

/// All of them: fingertip, stylus, arm.
std::span<const OperatorProfile> operator_profiles() noexcept;

/// The one of that name, or null.
const OperatorProfile* find_operator_profile(std::string_view name) noexcept;

/// A heavy device of admittance type, without a hand: 2 kg, 20 N·s/m, 1 N, a force sensor, no other effect. It is
/// no real device: the numbers are those for which control.md 1.5 tried the admittance form of the limiter.
SimulatedDevice::Config admittance_device();

/// Every number of the profile, one per line: what, value with unit, provenance, source.
std::string provenance_table(const DeviceProfile& profile);
std::string provenance_table(const OperatorProfile& profile);

}  // namespace tendon
