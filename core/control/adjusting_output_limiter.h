// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Throws std::invalid_argument unless `longest_hold` is above zero.
void check_longest_hold(Duration longest_hold);

/// Bounds a force so that the device can never give out more energy than it took in, whatever is
/// upstream of it: late, slow, wrong or hostile.
///
///     f_max(n) = f_c + 2 √( b · max(E(n), 0) / T_max )
///     F(n)     = F_wanted(n) · min(1, f_max / ‖F_wanted‖)
///
/// E is the energy ledger, f_c and b lower bounds of the device's friction, T_max the guaranteed
/// longest time for which F will be held. In the joint form (N = 3) the direction is kept and the
/// result does not depend on the frame; with N = 1 and one ledger per axis it is the paper's per-axis form.
///
/// Theorem 1: if every F obeys the bound then E(n) ≥ 0 for all n, because no motion within one hold
/// can take more than T (‖F‖ − f_c)₊² / (4b) out of the ledger, and the bound says just that this is no
/// more than E(n). It is tight: a bound 1 % higher can be broken (see the tests). A jittery period is
/// covered by T_max here and the measured length in the ledger. With E < 0 (after an overrun) it lets
/// ‖F‖ ≤ f_c through, with which every later interval earns: the ledger recovers by itself.
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, eqs (7)–(9), Table I; vector form: control.md 8.5.
///
/// This is the bound alone; the controllers that keep the account with it are in core/control/aol.h.
///
/// Thread-safe: yes (no state). Realtime-safe: yes.
class AdjustingOutputLimiter {
 public:
  struct Config {
    Friction friction;
    Duration longest_hold{};  ///< T_max: no force may be held longer; > 0
  };

  /// Throws std::invalid_argument unless longest_hold > 0.
  explicit AdjustingOutputLimiter(const Config& config);

  /// The bound f_max (N) at `energy` (J).
  double permitted(double energy) const noexcept;

  /// Bounds `wanted` (N, on the hand). A wanted force that is not finite becomes zero, with the reason.
  template <int N>
  LimitedForce<N> limit(const Vec<N>& wanted, double energy) const noexcept {
    const double bound = permitted(energy);
    if (!wanted.allFinite()) return {Vec<N>::Zero(), bound, Reason::kNotFinite};
    const double size = wanted.norm();
    if (size <= bound) return {wanted, bound, {}};
    return {wanted * (bound / size), bound, Reason::kEnergy};
  }

 private:
  double coulomb_;
  double viscous_per_hold_;  ///< b / T_max, N/m
};

}  // namespace tendon
