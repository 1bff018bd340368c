// SPDX-License-Identifier: Apache-2.0
#include "core/control/reference_energy.h"

#include "core/control/law_support.h"

namespace tendon {

template <int N>
ReferenceEnergyController<N>::ReferenceEnergyController(const Config& config)
    : config_(config), port_(config.friction) {
  expect(std::isfinite(config.stiffness) && config.stiffness > 0, "stiffness", config.stiffness,
         "a finite number above 0 N/m");
  expect(config.max_damping > 0, "max_damping", config.max_damping, "a number above 0 N·s/m");
  expect(std::isfinite(config.min_speed) && config.min_speed >= 0, "min_speed", config.min_speed,
         "a finite number of 0 m/s or more");
}

template <int N>
void ReferenceEnergyController<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  dx_.setZero();
  if (!law_support::finite(interval) || interval.held <= Duration::zero()) return;
  dx_ = interval.dx;
  held_ = interval.held;
  observed_ -= interval.applied.dot(interval.dx);
}

template <int N>
void ReferenceEnergyController<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  dx_.setZero();
}

template <int N>
double ReferenceEnergyController<N>::reference(const Demand<N>& demand) const noexcept {
  if (demand.stiffness == Mat<N>::Zero()) return demand.force.squaredNorm() / (2 * config_.stiffness);
  const auto principal = law_support::principal_stiffness<N>(demand.stiffness);
  const double least = 1e-9 * principal.values[N - 1];  // smaller values are rounding errors
  double energy = 0;
  for (int i = 0; i < N; ++i) {
    const double stiffness = principal.values[i];
    if (stiffness <= least || stiffness <= 0) continue;
    const double force = principal.vectors.col(i).dot(demand.force);
    energy += force * force / (2 * stiffness);
  }
  return energy;
}

template <int N>
LimitedForce<N> ReferenceEnergyController<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) return law_support::refused<N>(kNoBound);
  const double missing = reference(demand) - (observed_ - demand.force.dot(dx_));
  const double damping = series_damping(missing, dx_.squaredNorm(), held_, config_.min_speed, config_.max_damping);
  if (damping == 0) return {demand.force, kNoBound, {}};
  const Vec<N> force = demand.force - damping / seconds(held_) * dx_;
  if (!force.allFinite()) return law_support::refused<N>(kNoBound);
  return {force, kNoBound, Reason::kEnergy};
}

template class ReferenceEnergyController<1>;
template class ReferenceEnergyController<3>;
template class ReferenceEnergyController<6>;

}  // namespace tendon
