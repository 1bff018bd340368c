// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/compensated_sum.h"
#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Keeps the account of the device: a lower bound of the energy that the hand has put into it and not got back.
///
///     E(n) = Σₖ [ f(k−1)·Δx(k) + f_c ‖Δx(k)‖ + b ‖Δx(k)‖² / T(k) ],   E(0) = 0
///
/// with f = −F the reflective force that was **really held** during interval k (F is on the hand), Δx
/// the displacement in it and T(k) its **measured** length. The work W of the hand satisfies
/// W(n) + KE(0) ≥ E(n) for every motion: the device's friction dissipates at least b ‖Δx‖²/T
/// (Cauchy–Schwarz) and f_c ‖Δx‖ in an interval. So the port is passive as long as E is never negative.
///
/// Source: Lee & Lee 2009, eqs (5), (6) (one degree of freedom); the vector form with Euclidean norms
/// for isotropic friction is derived in control.md 8.5. Exact for exact position sensing; an encoder
/// of resolution Δ can over-credit (control.md 8.9).
///
/// `N` is the number of degrees of freedom that share one account: 3 for the joint form, 1 for each
/// axis of the paper's per-axis form.
///
/// Thread-safe: no. Realtime-safe: yes.
class EnergyLedger {
 public:
  /// Throws std::invalid_argument unless both bounds are finite and not negative.
  explicit EnergyLedger(const Friction& friction);

  /// Books one interval and returns the new energy (J).
  ///
  /// `applied` (N, on the hand) was held for all of `held`, while the hand moved by `dx` (m). A `held`
  /// that is not positive earns no viscous credit. When anything is not finite nothing is booked.
  template <int N>
  double observe(const Eigen::Matrix<double, N, 1>& applied, const Eigen::Matrix<double, N, 1>& dx,
                 Duration held) noexcept {
    const double squared = dx.squaredNorm();
    return book(-applied.dot(dx), squared, held);
  }

  /// Books an interval in which a force of norm `applied` (N) was held for at most `at_most` and then
  /// vanished, while nobody saw the motion: the device's own watchdog ended it, a reading failed. The
  /// worst that any motion can have done to the account in that time (eq. (7)):
  ///
  ///     ΔE = −at_most · (‖F‖ − f_c)₊² / (4b)
  ///
  /// No motion earns credit in it. With b = 0 a force above f_c has no such bound; then nothing is booked (the limiter
  /// keeps such forces at f_c).
  double observe_unseen(double applied, Duration at_most) noexcept;

  /// Adds `energy` (J) that the account of another port has given up, or takes away what this one gives (negative). A
  /// value that is not finite changes nothing. E is then the account of a port that shares (Purse), no more the ledger
  /// of this port alone.
  void transfer(double energy) noexcept;

  /// From the next interval on friction has these lower bounds. Throws nothing: values that are not finite
  /// or negative change nothing.
  void adapt(const Friction& friction) noexcept;

  /// E, J. Negative only after a hold longer than the limiter's bound counted on (OutputBound), or in a force that no
  /// limiter bounds.
  double energy() const noexcept { return energy_.value(); }

 private:
  double book(double work, double squared_displacement, Duration held) noexcept;

  Friction friction_;
  CompensatedSum energy_;
};

}  // namespace tendon
