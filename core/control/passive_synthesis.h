// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Scales a whole force field by one factor, so that the friction of the device dissipates the energy that sampling and
/// delay generate.
///     F = γ F_wanted,    γ = min(1, b / (K_max (T/2 + t_d)))
/// K_max (N/m) is the steepest slope of the field: the larger of `stiffness` and the spectral norm of the stiffest
/// demand so far. Therefore, γ never increases. If the slope is unknown, the force is zero. Soft parts of the field
/// become softer as well.
///
/// The port is passive for a static field with a convex potential and slopes up to K_max, if it is sampled in every
/// period, delivered t_d late (a multiple of the period), and applied unchanged. The field must be constant over time.
///
/// Source: Mahvash & Hayward, IEEE Trans. Robotics 21(1), 2005 (recalled); proof: core/PROOFS.md, "Comparison laws".
/// Learning K_max from the demands is ours; it only affects later forces.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PassiveSynthesis {
 public:
  struct Config {
    Friction friction;                  ///< f_c is only for the ledger; b > 0
    Duration longest_hold{};            ///< T, > 0
    Duration delay{};                   ///< t_d, the delay of the environment, ≥ 0
    std::optional<double> stiffness{};  ///< N/m, > 0, lower limit of K_max; if empty, this is learned from the demands
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit PassiveSynthesis(const Config& config);

  void observe(const Interval<N>& interval) noexcept { port_.observe(interval.applied, interval.dx, interval.held); }
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
    port_.observe_unseen(applied.norm(), at_most);
  }
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double affordable_;  ///< N/m, b/(T/2 + t_d)
  double steepest_;    ///< N/m, K_max, or 0 if it is unknown
  EnergyLedger port_;
};

}  // namespace tendon
