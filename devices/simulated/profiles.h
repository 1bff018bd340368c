// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger/friction.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// The source of a number, starting with the most reliable one.
enum class Provenance {
  kMeasured,  ///< measured by us on a real device
  kQuoted,    ///< read in the specified source, or computed using its values
  kRecalled,  ///< quoted from memory; must be checked
  kAssumed,   ///< for the given reason
};

std::string_view to_string(Provenance provenance) noexcept;

struct KnownNumber {
  double value;
  Provenance provenance;
  std::string_view note;
};

/// Initial values for simulation. Units differ, so a limiter requires the identified friction of the actual unit.
struct DeviceProfile {
  std::string_view name;
  KnownNumber mass;                     ///< kg
  KnownNumber viscous_friction;         ///< N·s/m
  KnownNumber coulomb_friction;         ///< N
  KnownNumber encoder_step;             ///< m
  KnownNumber max_force;                ///< N
  KnownNumber amplifier_bandwidth;      ///< Hz
  std::optional<KnownNumber> watchdog;  ///< s
  KnownNumber viscous_bound;            ///< N·s/m, for the limiter
  KnownNumber coulomb_bound;            ///< N, for the limiter

  SimulatedDevice::Config device() const;  ///< without a hand
  /// Lower bounds, for the limiter.
  Friction friction_bounds() const noexcept { return {.coulomb = coulomb_bound.value, .viscous = viscous_bound.value}; }
};

std::span<const DeviceProfile> device_profiles() noexcept;  ///< phantom-premium, touch, falcon

const DeviceProfile* find_device_profile(std::string_view name) noexcept;  ///< null if there is no such profile

struct KnownRange {
  double least;
  double most;
  Provenance provenance;
  std::string_view note;

  double middle() const noexcept { return least + (most - least) / 2; }  ///< the default
};

/// Parameters of a finger, hand or arm. They vary between people and increase with the grip force. A spring, a damper
/// and a mass are the simplest model that is different from a wall. Not accurate above about 50 Hz or for a light grip.
struct OperatorProfile {
  std::string_view name;
  KnownRange stiffness;  ///< N/m
  KnownRange damping;    ///< N·s/m
  KnownRange mass;       ///< kg

  OperatorHand::Config hand(ScriptedMotion motion) const;  ///< in the middle of each range
};

std::span<const OperatorProfile> operator_profiles() noexcept;  ///< fingertip, stylus, arm

const OperatorProfile* find_operator_profile(std::string_view name) noexcept;  ///< null if there is no such profile

/// Not a real device: admittance type, 2 kg, 20 N·s/m, 1 N, force sensor, no hand (core/PROOFS.md, "Admittance loop").
SimulatedDevice::Config admittance_device();

/// One line per number, with its unit, provenance and source.
std::string provenance_table(const DeviceProfile& profile);
std::string provenance_table(const OperatorProfile& profile);

}  // namespace tendon
