// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/compensated_sum.h"
#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon {

/// A lower bound of the energy that the hand has supplied to the device through a port and not received back.
///     E(n) = Σₖ [ f(k−1)·Δx(k) + f_c ‖Δx(k)‖ + b ‖Δx(k)‖²/T(k) ],   E(0) = 0
/// f = −F is the reflective force that was **really held** in interval k (F is on the hand), Δx the displacement in it,
/// and T(k) its **measured** length. For every motion the work W of the hand satisfies W(n) + KE(0) ≥ E(n), so the port
/// is passive as long as E ≥ 0. Use RobustLedger if the positions are not exact. `N` is the number of coordinates with
/// isotropic friction: 3 for the joint form, 1 per axis for the form of the paper.
///
/// Source: Lee & Lee 2009, eqs (5), (6); the vector form: core/PROOFS.md, "Energy ledger".
/// Thread-safe: no. Realtime-safe: yes.
class EnergyLedger {
 public:
  /// Throws std::invalid_argument if a bound is negative or not finite.
  explicit EnergyLedger(const Friction& friction);

  /// Books one interval and returns E in J. The device held the force `applied` (N, on the hand) for the time `held`,
  /// while the hand moved by `dx` (m). Non-finite intervals are ignored. There is no viscous credit unless `held` > 0.
  template <int N>
  double observe(const Eigen::Matrix<double, N, 1>& applied, const Eigen::Matrix<double, N, 1>& dx,
                 Duration held) noexcept {
    const double squared = dx.squaredNorm();
    return book(-applied.dot(dx), squared, held);
  }

  /// Books the worst motion of an interval if the position was not measured, because the watchdog ended the hold or a
  /// reading failed. A force of norm `applied` (N) was held for at most `at_most` and then set to zero:
  ///     ΔE = −at_most · (‖F‖ − f_c)₊² / (4b)
  /// If b is 0, there is no such bound above f_c. Nothing is booked then, and the limiter reduces the force to f_c.
  double observe_unseen(double applied, Duration at_most) noexcept;

  /// Adds energy (J) from the account of another port, or subtracts it if the value is negative. E is then a shared
  /// account (EnergyTank). Ignores values that are not finite.
  void transfer(double energy) noexcept;

  /// Sets the lower bounds of friction from the next interval on. Ignores values that are negative or not finite.
  void adapt(const Friction& friction) noexcept;

  /// Returns E in J. It can be negative if there is no limiter or a hold was too long (see OutputBound).
  double energy() const noexcept { return energy_.value(); }

 private:
  double book(double work, double squared_displacement, Duration held) noexcept;

  Friction friction_;
  CompensatedSum energy_;
};

}  // namespace tendon
