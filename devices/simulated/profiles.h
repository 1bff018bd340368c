// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger/friction.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// Starting with the most reliable.
enum class Provenance {
  kMeasured,  ///< measured by us on a real device
  kQuoted,    ///< read in the source, or computed from it
  kRecalled,  ///< quoted from memory; must be checked
  kAssumed,   ///< for the given reason
};

std::string_view to_string(Provenance provenance) noexcept;

struct KnownNumber {
  double value;
  Provenance provenance;
  std::string_view note;
};

/// Initial values for simulating a device, which may differ for each unit. The friction of the actual unit must be
/// identified before using a limiter.
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

  /// Without a hand.
  SimulatedDevice::Config device() const;
  /// Lower bounds, for the limiter.
  Friction friction_bounds() const noexcept { return {.coulomb = coulomb_bound.value, .viscous = viscous_bound.value}; }
};

/// phantom-premium, touch, falcon
std::span<const DeviceProfile> device_profiles() noexcept;

/// Returns null if there is no such profile.
const DeviceProfile* find_device_profile(std::string_view name) noexcept;

struct KnownRange {
  double least;
  double most;
  Provenance provenance;
  std::string_view note;

  /// To be used by default.
  double middle() const noexcept { return least + (most - least) / 2; }
};

/// Parameters of a finger, hand or arm. They vary between people and increase with the grip force. A spring, a damper
/// and a mass are the simplest model that differs from a wall. It is not accurate above about 50 Hz, or with a very
/// light grip.
struct OperatorProfile {
  std::string_view name;
  KnownRange stiffness;  ///< N/m
  KnownRange damping;    ///< N·s/m
  KnownRange mass;       ///< kg

  /// Uses the middle of each range.
  OperatorHand::Config hand(ScriptedMotion motion) const;
};

/// fingertip, stylus, arm
std::span<const OperatorProfile> operator_profiles() noexcept;

/// Returns null if there is no such profile.
const OperatorProfile* find_operator_profile(std::string_view name) noexcept;

/// A heavy device of admittance type without a hand: 2 kg, 20 N·s/m, 1 N, and a force sensor. Not a real device;
/// see core/PROOFS.md, "Admittance loop".
SimulatedDevice::Config admittance_device();

/// One line per number, with its unit, provenance and source.
std::string provenance_table(const DeviceProfile& profile);
std::string provenance_table(const OperatorProfile& profile);

}  // namespace tendon
