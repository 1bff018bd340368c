// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger/friction.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// The origin of a number, from the most to the least reliable.
enum class Provenance {
  kMeasured,  ///< identified by us on a real device
  kQuoted,    ///< read in the named source, or computed from its data
  kRecalled,  ///< quoted from memory of the named source; check it before you rely on it
  kAssumed,   ///< a guess; the note gives the reason
};

std::string_view to_string(Provenance provenance) noexcept;

/// A number and its origin.
struct KnownNumber {
  double value;
  Provenance provenance;
  std::string_view note;  ///< source or reason
};

/// Parameters of a real device, for a simulated device like it. They are initial values and not those of a particular
/// unit. Before a limiter runs on hardware, identify the friction of that unit.
struct DeviceProfile {
  std::string_view name;
  KnownNumber mass;                     ///< kg
  KnownNumber viscous_friction;         ///< N·s/m
  KnownNumber coulomb_friction;         ///< N
  KnownNumber encoder_step;             ///< m
  KnownNumber max_force;                ///< N
  KnownNumber amplifier_bandwidth;      ///< Hz
  std::optional<KnownNumber> watchdog;  ///< s; empty for a device without a watchdog
  KnownNumber viscous_bound;            ///< N·s/m, for the limiter
  KnownNumber coulomb_bound;            ///< N, for the limiter

  /// Returns the configuration of the simulated device, without a hand. Its `info()` has the numbers of the data sheet.
  SimulatedDevice::Config device() const;
  /// The friction that the limiter may assume, never above that of the device.
  Friction friction_bounds() const noexcept { return {.coulomb = coulomb_bound.value, .viscous = viscous_bound.value}; }
};

/// All device profiles: phantom-premium, touch, falcon.
std::span<const DeviceProfile> device_profiles() noexcept;

/// Returns the profile of that name, or null.
const DeviceProfile* find_device_profile(std::string_view name) noexcept;

/// The range of a number, and its origin.
struct KnownRange {
  double least;
  double most;
  Provenance provenance;
  std::string_view note;  ///< source or reason

  /// The value to use if nothing else is known.
  double middle() const noexcept { return least + (most - least) / 2; }
};

/// Parameters of a finger, hand or arm that holds the handle, for a simulated hand like it. Each one is a range,
/// because people differ and because a firmer grip is stiffer. A spring, a damper and a mass are the simplest model
/// that distinguishes a hand from a wall. It is inaccurate above about 50 Hz and for a grip force close to zero.
struct OperatorProfile {
  std::string_view name;
  KnownRange stiffness;  ///< N/m
  KnownRange damping;    ///< N·s/m
  KnownRange mass;       ///< kg

  /// Returns the hand with the middle of all three ranges.
  OperatorHand::Config hand(ScriptedMotion motion) const;
};

/// All operator profiles: fingertip, stylus, arm.
std::span<const OperatorProfile> operator_profiles() noexcept;

/// Returns the profile of that name, or null.
const OperatorProfile* find_operator_profile(std::string_view name) noexcept;

/// A heavy device of admittance type, without a hand: 2 kg, 20 N·s/m, 1 N, a force sensor, no other effects. It does
/// not represent a real device. These are the parameters in core/PROOFS.md, "Admittance loop".
SimulatedDevice::Config admittance_device();

/// Lists every number of a profile, one per line: name, value with unit, provenance, source.
std::string provenance_table(const DeviceProfile& profile);
std::string provenance_table(const OperatorProfile& profile);

}  // namespace tendon
