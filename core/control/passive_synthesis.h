// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Softens a whole force field by one factor, so far that the device's friction pays for sampling and delay.
///
///     F = γ F_wanted,    γ = min(1, b / (K_max (T/2 + t_d)))
///
/// K_max (N/m) is the steepest slope of the field: `stiffness`, or the spectral norm of the stiffest demand so far,
/// whichever is larger. It never forgets, so γ only falls. While no slope is known (demands without stiffness, and none
/// configured) the force is zero, because nothing could be promised.
///
/// Passive for a static field with a convex potential whose slope K_max really bounds, sampled in every period and
/// delivered t_d late (a multiple of the period), when what is returned is what is held: the force differs from the
/// field's own by at most K_max times the way since it was sampled, whose mean age is T/2 + t_d. A field that changes
/// with time is scaled, without any promise. Even the soft parts of the field are softened.
///
/// Source: Mahvash & Hayward, IEEE Trans. Robotics 21(1), 2005 (recalled; proof: control.md 5.6). Learning K_max from
/// the demand is ours: a slope that is met for the first time is paid only from then on.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PassiveSynthesis {
 public:
  struct Config {
    Friction friction;                  ///< f_c serves the ledger alone; b > 0
    Duration longest_hold{};            ///< T, > 0
    Duration delay{};                   ///< t_d, ≥ 0: from the position to the force that answers it
    std::optional<double> stiffness{};  ///< N/m, > 0: least value of K_max; left out: learned from the demands
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit PassiveSynthesis(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double affordable_;  ///< N/m, b/(T/2 + t_d)
  double steepest_;    ///< N/m, K_max; 0: not known
  EnergyLedger port_;
};

}  // namespace tendon
