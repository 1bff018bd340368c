// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/ledger/friction.h"
#include "core/ledger/port.h"

namespace tendon {

/// How large a force may be, so that no motion within one hold can make the energy ledger negative.
///
/// The most that a motion can take out of the ledger while the force f = ‖F‖ (N) is held:
///
///     ℓ(f) = max over 0 ≤ y ≤ L of  (f − f_c) y − b y²/T        J;  y is the travel along F, m
///
///          = T (f − f_c)₊² / (4b)              while the worst travel T (f − f_c)/(2b) ≤ L
///          = (f − f_c) L − b L²/T              beyond
///
/// A force may be held when ℓ(f) ≤ E. Without a bound on the travel (L = ∞) that is equation (8) of the paper,
///
///     f_max = f_c + 2 √( b · max(E, 0) / T_max )
///
/// and with one it is the bounded-acceleration form (control.md 8.7).
///
/// Theorem 1: if every force obeys the bound and no hold is longer than T_max, then E(n) ≥ 0 for all n. It is tight: a
/// bound 1 % higher can be broken (see the tests). A jittery period is covered by T_max here and by the measured length
/// in the ledger. While E < 0 the bound is f_c, with which every later interval earns: the ledger recovers by itself.
///
/// A hold of length T_act > T_max takes at most (T_act − T_max)(f − f_c)₊²/(4b) more than the ledger has, which is at
/// most (T_act/T_max − 1) E. HoldBound keeps such holds rare.
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, eqs (7)–(9), Table I; vector form: control.md 8.5.
///
/// Thread-safe: yes (a value). Realtime-safe: all but `of`.
struct OutputBound {
  double coulomb = 0;                                      ///< f_c, N
  double viscous_per_hold = 0;                             ///< b/T_max, N/m
  double reach = std::numeric_limits<double>::infinity();  ///< L, m; ≤ 0: no motion along F is possible

  /// Throws std::invalid_argument unless longest_hold (T_max) is above zero.
  static OutputBound of(const Friction& friction, Duration longest_hold);

  /// ℓ(force), J; +∞ where friction does not bound it (b = 0, L = ∞, force above f_c).
  double at(double force) const noexcept { return beyond_friction(force - coulomb); }
  /// ℓ(f_c + excess), J.
  double beyond_friction(double excess) const noexcept;
  /// dℓ/df at `force`, m: the worst travel.
  double slope(double force) const noexcept;
  /// f_max, the largest force (N) with ℓ ≤ max(energy, 0):
  ///
  ///     f_c + 2 √(b E/T)             when E ≤ b L²/T
  ///     f_c + b L/T + E/L            beyond;   ∞ when L ≤ 0
  ///
  /// f_c when `energy` (J) is not a number.
  double largest(double energy) const noexcept {
    if (reach <= 0) return std::numeric_limits<double>::infinity();
    // max(E, 0) written so that a NaN energy permits friction only.
    if (!(energy > 0)) return coulomb;
    if (reach < std::numeric_limits<double>::infinity() && energy > viscous_per_hold * reach * reach) {
      return coulomb + viscous_per_hold * reach + energy / reach;
    }
    return coulomb + 2 * std::sqrt(viscous_per_hold * energy);
  }

  /// Shortens `wanted` (N, on the hand) to f_max and keeps its direction. A force that is not finite becomes zero, with
  /// the reason.
  template <int N>
  LimitedForce<N> limit(const Vec<N>& wanted, double energy) const noexcept {
    const double bound = largest(energy);
    if (!wanted.allFinite()) return {Vec<N>::Zero(), bound, Reason::kNotFinite};
    const double size = wanted.norm();
    if (size <= bound) return {wanted, bound, {}};
    return {wanted * (bound / size), bound, Reason::kEnergy};
  }
};

/// The largest γ ≥ 0 with Σ ℓ_i(γ · size_i) ≤ max(energy, 0): how much of a force whose parts have these sizes may be
/// held when all of them live on one ledger; +∞ when nothing bounds it. Joint-space box form of control.md 8.5.
template <std::size_t Parts>
double largest_scale(const std::array<OutputBound, Parts>& bounds, const std::array<double, Parts>& sizes,
                     double energy) noexcept;

}  // namespace tendon
