// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Passes every static force law that is no steeper than the device's friction affords, and ties all others to the hand
/// by a spring of that slope: virtual coupling by its slope condition.
///
/// A spring K_max ties the hand to a proxy. While the proxy stays, the reflective force f = −F becomes g; it becomes
/// f(n) when the proxy gives way by (g − f(n))/K_max. The proxy has taken in the energy P so far:
///
///     g    = f(n−1) + K_max Δx(n)
///     f(n) = the force nearest to f_e with  P(n) = P(n−1) + f(n)·(g − f(n))/K_max ≥ 0
///
/// (a ball about g/2). N, m, J; P(0) = 0. Passive for **every** demand if
///
///     b ≥ K_max T/2
///
/// because E(n) ≥ ‖f(n)‖²/(2 K_max) + P(n) at every step (K_max/2 ≤ b/T pays for the sampling), and the worst motion in
/// a hold takes no more than the first of the two. And a static field that starts at rest, has a convex potential and a
/// slope within [0, K_max] passes **unchanged**: its proxy takes U − ‖f‖²/(2 K_max) ≥ 0. A field with less than that —
/// late, or stiffer — is shown as a spring of K_max that yields.
///
/// A force that the device shortens keeps all this. An interval that was not seen, or is not finite, starts from zero
/// force with the P there is.
///
/// Source: the slope condition is that of Lee & Lee's nonlinear virtual coupling (ref. [17] of IEEE TCST 17(4), 2009),
/// whose formula is lost to us; the law and both proofs are ours (control.md 5.8 has the condition). Digital damping B
/// is not a part of it: b ≥ K_max T/2 + |B| would be needed.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class NonlinearCoupling {
 public:
  struct Config {
    Friction friction;                  ///< f_c serves the ledger alone; b > 0
    Duration longest_hold{};            ///< T, > 0
    std::optional<double> max_slope{};  ///< K_max, N/m, in (0, 2b/T]; left out: 2b/T
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit NonlinearCoupling(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// P, J: the energy that the proxy has taken in and can give back.
  double account() const noexcept { return account_; }

 private:
  double max_slope_;
  EnergyLedger port_;
  Vec<N> returned_ = Vec<N>::Zero();  ///< N, reflective: what `limit` said last
  Vec<N> elastic_ = Vec<N>::Zero();   ///< g, N
  double account_ = 0;
};

}  // namespace tendon
