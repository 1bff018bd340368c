// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/passivity_controller.h"
#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Adds damping as soon as the environment holds less energy than an ideal one would: passivity control that follows a
/// reference energy, instead of waiting until all energy is lost.
///
///     E(n)     = Σ f(n−1)·Δx(n)                        what has gone in (J), f = −F really held
///     E_ref(n) = ½ F_wanted(n)ᵀ K⁻¹ F_wanted(n)        what a spring of stiffness K holds at that force (J)
///     α(n)     = (E_ref − E − f_e·Δx)/(T ‖v‖²)  when E + f_e·Δx < E_ref, within [0, max_damping]
///     F(n)     = F_wanted(n) − α(n) v(n)               v = Δx/T, m/s
///
/// K is the demand's stiffness where it sends one (its symmetric part; directions without stiffness hold nothing), else
/// `stiffness`. Quiet on stiff walls **if** the environment is that spring and its force is fresh in every period; with
/// a reference that is not the environment's own, it brakes without need or too late. It promises nothing about the
/// hand's port (see PassivityController).
///
/// Source: Ryu, Preusche, Hannaford, Hirzinger, IEEE TCST 13(5), 2005 (recalled); the trigger uses the predicted energy
/// as PassivityObserver::kZohExact does. control.md 5.2.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class ReferenceEnergyController {
 public:
  struct Config {
    Friction friction;        ///< for the ledger alone
    double stiffness = 0;     ///< N/m, > 0: of an environment that does not send its own
    double max_damping = 0;   ///< N·s/m, > 0; far below 2m/T
    double min_speed = 1e-4;  ///< m/s, ≥ 0: slower motion is not divided by
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit ReferenceEnergyController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// E, J.
  double observed() const noexcept { return observed_; }
  /// E_ref of a demand, J.
  double reference(const Demand<N>& demand) const noexcept;

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  Vec<N> dx_ = Vec<N>::Zero();
  Duration held_{};
};

}  // namespace tendon
