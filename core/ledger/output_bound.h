// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/ledger/friction.h"
#include "core/ledger/port.h"

namespace tendon {

/// A bound on the force. It ensures that the energy ledger cannot become negative until the next step for any motion.
/// While a force of norm f (N) is held, a motion can take at most this energy from the ledger:
///     ℓ(f) = max over 0 ≤ y ≤ L of  (f − f_c) y − b y²/T        J;  y is the travel along F, m
///          = T (f − f_c)₊² / (4b)              while the worst travel T (f − f_c)/(2b) ≤ L
///          = (f − f_c) L − b L²/T              beyond
/// A force is permitted if ℓ(f) ≤ E. If the travel is not bounded (L = ∞), this is equation (8) of the paper,
///     f_max = f_c + 2 √( b · max(E, 0) / T_max )
/// If every force obeys the bound and is held for at most T_max, then E(n) ≥ 0 for all n (Theorem 1). The bound is
/// tight. If E is negative, the bound is f_c, and E recovers.
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, eqs (7)–(9), Table I; core/PROOFS.md, "Output bound" and "Bounded
/// acceleration".
/// Thread-safe: yes (a value). Realtime-safe: yes, except `of`.
struct OutputBound {
  double coulomb = 0;                                      ///< f_c, N
  double viscous_per_hold = 0;                             ///< b/T_max, N/m
  double reach = std::numeric_limits<double>::infinity();  ///< L, m; if ≤ 0, no motion along F is possible

  /// Throws std::invalid_argument if longest_hold (T_max) is not positive.
  static OutputBound of(const Friction& friction, Duration longest_hold);

  /// Returns ℓ(force) in J, or +∞ if friction does not bound it (b = 0, L = ∞, force above f_c).
  double at(double force) const noexcept { return beyond_friction(force - coulomb); }
  double beyond_friction(double excess) const noexcept;  ///< ℓ(f_c + excess), J
  double slope(double force) const noexcept;             ///< dℓ/df in m, which is the worst travel
  /// Returns f_max, the largest force (N) with ℓ ≤ max(energy, 0). The energy is in J. If it is NaN, the result is f_c.
  ///     f_c + 2 √(b E/T)             when E ≤ b L²/T
  ///     f_c + b L/T + E/L            beyond;   ∞ when L ≤ 0
  double largest(double energy) const noexcept {
    if (reach <= 0) return std::numeric_limits<double>::infinity();
    if (!(energy > 0)) return coulomb;
    if (reach < std::numeric_limits<double>::infinity() && energy > viscous_per_hold * reach * reach) {
      return coulomb + viscous_per_hold * reach + energy / reach;
    }
    return coulomb + 2 * std::sqrt(viscous_per_hold * energy);
  }

  /// Limits the norm of `wanted` (N, on the hand) to f_max. A non-finite force becomes zero with Reason::kNotFinite.
  template <int N>
  LimitedForce<N> limit(const Vec<N>& wanted, double energy) const noexcept {
    const double bound = largest(energy);
    if (!wanted.allFinite()) return {Vec<N>::Zero(), bound, Reason::kNotFinite};
    const double size = wanted.norm();
    if (size <= bound) return {wanted, bound, {}};
    return {wanted * (bound / size), bound, Reason::kEnergy};
  }
};

/// The box form: the largest γ ≥ 0 with Σ ℓ_i(γ · size_i) ≤ max(energy, 0), for forces of these sizes on one ledger; +∞
/// if nothing bounds it. Source: core/PROOFS.md, "Several coordinates".
template <std::size_t Parts>
double largest_scale(const std::array<OutputBound, Parts>& bounds, const std::array<double, Parts>& sizes,
                     double energy) noexcept;

}  // namespace tendon
