// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/output_bound.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace

OutputBound OutputBound::of(const Friction& friction, Duration longest_hold) {
  expect_above_zero(seconds(longest_hold), "longest_hold");
  return {.coulomb = friction.coulomb, .viscous_per_hold = friction.viscous / seconds(longest_hold)};
}

double OutputBound::slope(double force) const noexcept {
  if (!(force > coulomb) || reach <= 0) return 0;
  return std::min((force - coulomb) / (2 * viscous_per_hold), reach);
}

double OutputBound::at(double force) const noexcept {
  const double travel = slope(force);
  if (travel == 0) return 0;
  if (std::isinf(travel)) return kInfinite;
  return travel * ((force - coulomb) - viscous_per_hold * travel);
}

template <std::size_t Parts>
double largest_scale(const std::array<OutputBound, Parts>& bounds, const std::array<double, Parts>& sizes,
                     double energy) noexcept {
  if constexpr (Parts == 1) {
    return sizes[0] > 0 ? bounds[0].largest(energy) / sizes[0] : kInfinite;
  }
  const double budget = energy > 0 ? energy : 0;
  const auto loss_at = [&](double scale) {
    double sum = 0;
    for (std::size_t i = 0; i < Parts; ++i) sum += bounds[i].at(scale * sizes[i]);
    return sum;
  };
  // The sum is convex and smooth between the scales at which a part leaves Coulomb friction or meets its reach.
  std::array<double, 2 * Parts> corners;
  std::size_t count = 0;
  double ceiling = kInfinite;  // where friction gives no bound of the loss at all
  for (std::size_t i = 0; i < Parts; ++i) {
    const OutputBound& bound = bounds[i];
    if (!(sizes[i] > 0) || bound.reach <= 0) continue;
    corners[count++] = bound.coulomb / sizes[i];
    if (std::isfinite(bound.reach)) {
      corners[count++] = (bound.coulomb + 2 * bound.viscous_per_hold * bound.reach) / sizes[i];
    } else if (bound.viscous_per_hold == 0) {
      ceiling = std::min(ceiling, bound.coulomb / sizes[i]);
    }
  }
  std::sort(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count));
  double from = 0;
  for (std::size_t k = 0; k < count && corners[k] <= ceiling && loss_at(corners[k]) <= budget; ++k) from = corners[k];

  // From `from` on the sum is ℓ₀ + ℓ₁ δ + ℓ₂ δ² up to the next corner, behind which it exceeds the budget.
  double slope = 0;
  double curvature = 0;
  for (std::size_t i = 0; i < Parts; ++i) {
    const OutputBound& bound = bounds[i];
    // Compare quotients, as for the corners: `from` times the size may round to just below a corner.
    if (!(sizes[i] > 0) || bound.reach <= 0 || from < bound.coulomb / sizes[i]) continue;
    if (bound.viscous_per_hold == 0) {
      if (std::isfinite(bound.reach)) slope += bound.reach * sizes[i];
      continue;
    }
    slope += bound.slope(from * sizes[i]) * sizes[i];
    if (from < (bound.coulomb + 2 * bound.viscous_per_hold * bound.reach) / sizes[i]) {
      curvature += sizes[i] * sizes[i] / (4 * bound.viscous_per_hold);
    }
  }
  const double left = budget - loss_at(from);
  if (left <= 0) return std::min(from, ceiling);
  const double divisor = slope + std::sqrt(slope * slope + 4 * curvature * left);
  return std::min(divisor > 0 ? from + 2 * left / divisor : kInfinite, ceiling);
}

template double largest_scale<1>(const std::array<OutputBound, 1>&, const std::array<double, 1>&, double) noexcept;
template double largest_scale<2>(const std::array<OutputBound, 2>&, const std::array<double, 2>&, double) noexcept;
template double largest_scale<3>(const std::array<OutputBound, 3>&, const std::array<double, 3>&, double) noexcept;
template double largest_scale<6>(const std::array<OutputBound, 6>&, const std::array<double, 6>&, double) noexcept;

}  // namespace tendon
