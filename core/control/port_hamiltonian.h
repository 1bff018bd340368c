// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// An energy-consistent sampled port-Hamiltonian system: a spring whose state is the energy that has really gone in.
///
///     H(n) = H(n−1) + f(n−1)·Δx(n)                  J, f = −F as applied: exact for a zero-order hold
///     q(n) = √(2 H(n)/K)                            m, the corresponding state
///     F(n) = F_wanted · min(1, K q(n)/‖F_wanted‖)
///
/// K (N/m) is the stiffness of the demand along its force if that is positive, else `stiffness`. A plain spring would
/// hold ½ K x² while only ½ K x² − Σ ½ K Δx² has gone in (an energy leap). Here the storage pays for the leaps, so the
/// state lags behind the position. Two amounts that the storage cannot pay are booked as debt. Half of all income
/// repays it later:
///
///     leap       while moving into the force, q is at least the motion of the last interval (otherwise the spring
///                could not load from q = 0): ½ K ‖Δx‖² − H
///     overdraft  H below zero, because the hand moved further out than the state: H := 0
///
/// so H ≥ 0, and the energy that has gone in is at least H − debt. Neither friction nor mass is needed. Debt grows by
/// at most ½ K ‖Δx‖² per interval, so the port is passive for **every** demand if
///
///     K ≤ 2b/T
///
/// and for stiffer springs up to its debt. The storage is emptied when the environment demands no force.
///
/// Source: Stramigioli, Secchi, van der Schaft, Fantuzzi, IEEE Trans. Robotics 21(4), 2005 (abstract read, rest
/// recalled). The booking rules and the theorem are ours: core/PROOFS.md, "Comparison laws".
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PortHamiltonian {
 public:
  struct Config {
    Friction friction;     ///< only for the ledger
    double stiffness = 0;  ///< N/m, > 0: for demands without a stiffness
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit PortHamiltonian(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  /// Empties the storage, because the energy of the interval is unknown.
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
