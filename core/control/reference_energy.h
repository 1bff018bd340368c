// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/passivity_controller.h"
#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Passivity control with a reference energy. It adds damping if the environment has less energy than an ideal spring.
///     E(n)     = Σ f(n−1)·Δx(n)                        energy that was put in (J), f = −F as applied
///     E_ref(n) = ½ F_wanted(n)ᵀ K⁻¹ F_wanted(n)        energy of a spring K at that force (J)
///     α(n)     = (E_ref − E − f_e·Δx)/(T ‖v‖²)  when E + f_e·Δx < E_ref, within [0, max_damping]
///     F(n)     = F_wanted(n) − α(n) v(n)               v = Δx/T, m/s
/// K is the symmetric part of the stiffness of the demand, or `stiffness` if the demand has none. If there is no
/// stiffness in a direction, its energy is zero. The law is quiet on stiff walls if the environment is this spring and
/// its force is fresh in every period. Otherwise it can brake too much or too late. Passivity is not guaranteed.
///
/// Source: Ryu, Preusche, Hannaford, Hirzinger, IEEE TCST 13(5), 2005 (recalled). The trigger uses the predicted
/// energy, like PassivityObserver::kZohExact. core/PROOFS.md, "Comparison laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class ReferenceEnergyController {
 public:
  struct Config {
    Friction friction;        ///< only for the ledger
    double stiffness = 0;     ///< N/m, > 0, used if a demand has no stiffness
    double max_damping = 0;   ///< N·s/m, > 0, and much smaller than 2m/T
    double min_speed = 1e-4;  ///< m/s, ≥ 0: α is 0 for slower motion
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit ReferenceEnergyController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double observed() const noexcept { return observed_; }     ///< E, J
  double reference(const Demand<N>& demand) const noexcept;  ///< E_ref, J

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  Vec<N> dx_ = Vec<N>::Zero();
  Duration held_{};
};

}  // namespace tendon
