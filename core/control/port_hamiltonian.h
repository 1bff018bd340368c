// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// A spring whose state is the energy that has really gone into it: an energy-consistent sampled-data port-Hamiltonian
/// system.
///
///     H(n) = H(n−1) + f(n−1)·Δx(n)                  J, f = −F really held: exact for a zero-order hold
///     q(n) = √(2 H(n)/K)                            m, the state that belongs to it
///     F(n) = F_wanted · min(1, K q(n)/‖F_wanted‖)
///
/// K (N/m) is the demand's stiffness along its force where that is above zero, else `stiffness`. The plain spring would
/// hold ½ K x² while only ½ K x² − Σ ½ K Δx² has gone in: the energy leaps. Here the storage pays for them, and the
/// state lags behind the position. The storage cannot pay for two things; they are booked as debt and dissipated later,
/// from half of all income:
///
///     leap       while moving into the force, q is at least the motion of the last interval (from q = 0 nothing would
///                ever load): ½ K ‖Δx‖² − H
///     overdraft  H below zero, because the hand left further than the state reached: H := 0
///
/// so that H ≥ 0 always, and the energy that has gone in is never below H − debt. Neither friction nor mass is
/// needed. Debt grows by no more than ½ K ‖Δx‖² per interval, so the port is passive for **every** demand when
///
///     K ≤ 2b/T
///
/// and for stiffer springs only up to its debt. When the environment demands nothing the storage is emptied.
///
/// Source: Stramigioli, Secchi, van der Schaft, Fantuzzi, IEEE Trans. Robotics 21(4), 2005 (abstract read, rest
/// recalled); control.md 5.7. The rules for booking, one of many possible, and the theorem above are ours.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PortHamiltonian {
 public:
  struct Config {
    Friction friction;     ///< for the ledger alone
    double stiffness = 0;  ///< N/m, > 0: of an environment that does not send its own
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit PortHamiltonian(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  /// The energy that went in or out is unknown: the storage is emptied.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double stored() const noexcept { return stored_; }  ///< H, J
  double debt() const noexcept { return debt_; }      ///< J, booked and not yet dissipated

 private:
  void repay(double energy) noexcept;

  double stiffness_;
  EnergyLedger port_;
  double stored_ = 0;
  double debt_ = 0;
  Vec<N> dx_ = Vec<N>::Zero();  ///< m, that a leap may still use
};

}  // namespace tendon
