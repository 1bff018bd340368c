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

double OutputBound::beyond_friction(double excess) const noexcept {
  if (!(excess > 0) || reach <= 0) return 0;
  const double travel = std::min(excess / (2 * viscous_per_hold), reach);
  if (std::isinf(travel)) return kInfinite;
  return travel * (excess - viscous_per_hold * travel);
}

template <std::size_t Parts>
double largest_scale(const std::array<OutputBound, Parts>& bounds, const std::array<double, Parts>& sizes,
                     double energy) noexcept {
  if constexpr (Parts == 1) {
    return sizes[0] > 0 ? bounds[0].largest(energy) / sizes[0] : kInfinite;
  }
  const double budget = energy > 0 ? energy : 0;
  // The scales at which a part exceeds Coulomb friction (starts) or reaches L (corners). Excesses are measured from
  // `starts`, because scale · size can round to a value above the Coulomb friction at the start itself.
  std::array<double, Parts> starts;
  std::array<double, 2 * Parts> corners;
  std::size_t count = 0;
  double ceiling = kInfinite;  // if the scale is larger, ℓ is not finite
  for (std::size_t i = 0; i < Parts; ++i) {
    const OutputBound& bound = bounds[i];
    starts[i] = kInfinite;
    if (!(sizes[i] > 0) || bound.reach <= 0) continue;
    starts[i] = bound.coulomb / sizes[i];
    corners[count++] = starts[i];
    if (std::isfinite(bound.reach)) {
      corners[count++] = (bound.coulomb + 2 * bound.viscous_per_hold * bound.reach) / sizes[i];
    } else if (bound.viscous_per_hold == 0) {
      ceiling = std::min(ceiling, starts[i]);
    }
  }
  if (count == 0) return kInfinite;
  const auto loss_at = [&](double scale) {
    double sum = 0;
    for (std::size_t i = 0; i < Parts; ++i) {
      if (scale > starts[i]) sum += bounds[i].beyond_friction((scale - starts[i]) * sizes[i]);
    }
    return sum;
  };
  // The sum is convex, smooth between the corners, and zero at the first one.
  std::sort(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count));
  double from = corners[0];
  for (std::size_t k = 1; k < count && corners[k] <= ceiling && loss_at(corners[k]) <= budget; ++k) from = corners[k];

  // The sum is equal to ℓ₀ + ℓ₁ δ + ℓ₂ δ² until the next corner, where it exceeds the budget.
  double slope = 0;
  double curvature = 0;
  for (std::size_t i = 0; i < Parts; ++i) {
    const OutputBound& bound = bounds[i];
    if (from < starts[i]) continue;
    if (bound.viscous_per_hold == 0) {
      if (std::isfinite(bound.reach)) slope += bound.reach * sizes[i];
      continue;
    }
    slope += std::min((from - starts[i]) * sizes[i] / (2 * bound.viscous_per_hold), bound.reach) * sizes[i];
    if (from < (bound.coulomb + 2 * bound.viscous_per_hold * bound.reach) / sizes[i]) {
      curvature += sizes[i] * sizes[i] / (4 * bound.viscous_per_hold);
    }
  }
  const double left = budget - loss_at(from);
  if (left <= 0) return std::min(from, ceiling);
  const double divisor = slope + std::sqrt(slope * slope + 4 * curvature * left);
  if (divisor > 0) return std::min(from + 2 * left / divisor, ceiling);
  return slope + curvature > 0 ? from : ceiling;  // the square root of a tiny budget underflows
}

template double largest_scale<1>(const std::array<OutputBound, 1>&, const std::array<double, 1>&, double) noexcept;
template double largest_scale<2>(const std::array<OutputBound, 2>&, const std::array<double, 2>&, double) noexcept;
template double largest_scale<3>(const std::array<OutputBound, 3>&, const std::array<double, 3>&, double) noexcept;
template double largest_scale<6>(const std::array<OutputBound, 6>&, const std::array<double, 6>&, double) noexcept;

}  // namespace tendon
