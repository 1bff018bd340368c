// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace tendon {

/// The most that any motion within one hold can take out of the energy ledger, as a function of the force held:
///
///     ℓ(f) = max over 0 ≤ y ≤ L of  (f − f_c) y − b y²/T        (J;  f = ‖F‖ in N, y the travel along F in m)
///
///          = T (f − f_c)₊² / (4b)              while the worst travel T (f − f_c)/(2b) ≤ L
///          = (f − f_c) L − b L²/T              beyond
///
/// A force may be held when ℓ(f) ≤ E: the ledger cannot become negative then. Without a bound on the travel
/// (L = ∞) this is Lee & Lee's Table I; with one it is the bounded-acceleration form (control.md 8.7).
struct WorstLoss {
  double coulomb = 0;                                      ///< f_c, N
  double viscous_per_hold = 0;                             ///< b/T, N/m
  double reach = std::numeric_limits<double>::infinity();  ///< L, m; ≤ 0: no motion along F is possible

  /// ℓ(force), J; +∞ where friction does not bound it (b = 0, L = ∞, force above f_c).
  double at(double force) const noexcept;
  /// dℓ/df at `force`, m: the worst travel.
  double slope(double force) const noexcept;
  /// The largest force (N) with ℓ ≤ max(energy, 0):
  ///
  ///     f_c + 2 √(b E/T)             when E ≤ b L²/T
  ///     f_c + b L/T + E/L            beyond;   ∞ when L ≤ 0
  double largest(double energy) const noexcept;
};

/// The largest γ ≥ 0 with Σ ℓ_i(γ · size_i) ≤ max(energy, 0): how much of a force whose parts have these sizes may be
/// held when all of them live on one ledger; +∞ when nothing bounds it. Joint-space box form of control.md 8.5.
template <std::size_t Parts>
double largest_scale(const std::array<WorstLoss, Parts>& losses, const std::array<double, Parts>& sizes,
                     double energy) noexcept;

}  // namespace tendon
