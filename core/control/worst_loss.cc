// SPDX-License-Identifier: Apache-2.0
#include "core/control/worst_loss.h"

#include <algorithm>
#include <cmath>

namespace tendon {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace

double WorstLoss::slope(double force) const noexcept {
  if (!(force > coulomb) || reach <= 0) return 0;
  return std::min((force - coulomb) / (2 * viscous_per_hold), reach);
}

double WorstLoss::at(double force) const noexcept {
  const double travel = slope(force);
  if (travel == 0) return 0;
  if (std::isinf(travel)) return kInfinite;
  return travel * ((force - coulomb) - viscous_per_hold * travel);
}

double WorstLoss::largest(double energy) const noexcept {
  if (reach <= 0) return kInfinite;
  // max(E, 0) written so that a NaN energy permits friction only.
  if (!(energy > 0)) return coulomb;
  if (std::isfinite(reach) && energy > viscous_per_hold * reach * reach) {
    return coulomb + viscous_per_hold * reach + energy / reach;
  }
  return coulomb + 2 * std::sqrt(viscous_per_hold * energy);
}

template <std::size_t Parts>
double largest_scale(const std::array<WorstLoss, Parts>& losses, const std::array<double, Parts>& sizes,
                     double energy) noexcept {
  if constexpr (Parts == 1) {
    return sizes[0] > 0 ? losses[0].largest(energy) / sizes[0] : kInfinite;
  }
  const double budget = energy > 0 ? energy : 0;
  const auto loss_at = [&](double scale) {
    double sum = 0;
    for (std::size_t i = 0; i < Parts; ++i) sum += losses[i].at(scale * sizes[i]);
    return sum;
  };
  // The sum is convex and smooth between the scales at which a part leaves Coulomb friction or meets its reach.
  std::array<double, 2 * Parts> corners;
  std::size_t count = 0;
  double ceiling = kInfinite;  // where friction gives no bound of the loss at all
  for (std::size_t i = 0; i < Parts; ++i) {
    const WorstLoss& loss = losses[i];
    if (!(sizes[i] > 0) || loss.reach <= 0) continue;
    corners[count++] = loss.coulomb / sizes[i];
    if (std::isfinite(loss.reach)) {
      corners[count++] = (loss.coulomb + 2 * loss.viscous_per_hold * loss.reach) / sizes[i];
    } else if (loss.viscous_per_hold == 0) {
      ceiling = std::min(ceiling, loss.coulomb / sizes[i]);
    }
  }
  std::sort(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count));
  double from = 0;
  for (std::size_t k = 0; k < count && corners[k] <= ceiling && loss_at(corners[k]) <= budget; ++k) from = corners[k];

  // From `from` on the sum is ℓ₀ + ℓ₁ δ + ℓ₂ δ² up to the next corner, behind which it exceeds the budget.
  double slope = 0;
  double curvature = 0;
  for (std::size_t i = 0; i < Parts; ++i) {
    const WorstLoss& loss = losses[i];
    // The quotients, as among the corners: `from` times the size may round to just below one.
    if (!(sizes[i] > 0) || loss.reach <= 0 || from < loss.coulomb / sizes[i]) continue;
    if (loss.viscous_per_hold == 0) {
      if (std::isfinite(loss.reach)) slope += loss.reach * sizes[i];
      continue;
    }
    slope += loss.slope(from * sizes[i]) * sizes[i];
    if (from < (loss.coulomb + 2 * loss.viscous_per_hold * loss.reach) / sizes[i]) {
      curvature += sizes[i] * sizes[i] / (4 * loss.viscous_per_hold);
    }
  }
  const double left = budget - loss_at(from);
  if (left <= 0) return std::min(from, ceiling);
  const double divisor = slope + std::sqrt(slope * slope + 4 * curvature * left);
  return std::min(divisor > 0 ? from + 2 * left / divisor : kInfinite, ceiling);
}

template double largest_scale<1>(const std::array<WorstLoss, 1>&, const std::array<double, 1>&, double) noexcept;
template double largest_scale<2>(const std::array<WorstLoss, 2>&, const std::array<double, 2>&, double) noexcept;
template double largest_scale<3>(const std::array<WorstLoss, 3>&, const std::array<double, 3>&, double) noexcept;
template double largest_scale<6>(const std::array<WorstLoss, 6>&, const std::array<double, 6>&, double) noexcept;

}  // namespace tendon
