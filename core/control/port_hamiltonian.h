// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// An energy-consistent sampled port-Hamiltonian system: a spring whose state follows from the energy put in.
///     H(n) = H(n−1) + f(n−1)·Δx(n)                  J, f = −F as applied: exact for a zero-order hold
///     q(n) = √(2 H(n)/K)                            m, the corresponding state
///     F(n) = F_wanted · min(1, K q(n)/‖F_wanted‖)
/// K (N/m) is the stiffness of the demand along its force if that is positive, else `stiffness`. A plain sampled spring
/// has the energy ½ K x², although only ½ K x² − Σ ½ K Δx² was put in. Here the storage pays for the difference, so the
/// state lags behind the position. Two amounts are booked as debt, which is repaid by half of all energy put in later:
///     leap       while the hand moves into the force, q is at least the last motion, because the spring could not
///                load from q = 0 otherwise: ½ K ‖Δx‖² − H
///     overdraft  H < 0, because the hand moved further out than the state: H := 0
/// So H ≥ 0. Debt grows by at most ½ K ‖Δx‖² per interval, so the port is passive for every demand if
///     K ≤ 2b/T
/// The storage is emptied if the environment demands no force.
///
/// Source: Stramigioli, Secchi, van der Schaft, Fantuzzi, IEEE Trans. Robotics 21(4), 2005 (abstract read, rest
/// recalled). The booking rules and the theorem are ours: core/PROOFS.md, "Comparison laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PortHamiltonian {
 public:
  struct Config {
    Friction friction;     ///< only for the ledger
    double stiffness = 0;  ///< N/m, > 0, used if a demand has no stiffness
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit PortHamiltonian(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  /// Empties the storage because the energy of this interval is not known.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double stored() const noexcept { return stored_; }  ///< H, J
  double debt() const noexcept { return debt_; }      ///< J, booked and not yet repaid

 private:
  void repay(double energy) noexcept;

  double stiffness_;
  EnergyLedger port_;
  double stored_ = 0;
  double debt_ = 0;
  Vec<N> dx_ = Vec<N>::Zero();  ///< m, available for a leap
};

}  // namespace tendon
