// SPDX-License-Identifier: Apache-2.0
#include "core/control/passivity_controller.h"

#include "core/control/law_support.h"

namespace tendon {

namespace {

template <int N>
Interval<N> nothing_seen() noexcept {
  return {Vec<N>::Zero(), Vec<N>::Zero(), Duration::zero()};
}

}  // namespace

double series_damping(double missing, double squared_motion, Duration held, double min_speed,
                      double max_damping) noexcept {
  const double period = seconds(held);
  if (!(missing > 0) || !(squared_motion > 0) || squared_motion <= min_speed * min_speed * period * period) return 0;
  return std::min(missing * period / squared_motion, max_damping);
}

template <int N>
PassivityController<N>::PassivityController(const Config& config) : config_(config), port_(config.friction) {
  expect(config.max_damping > 0, "max_damping", config.max_damping, "a number above 0 N·s/m");
  expect(std::isfinite(config.min_speed) && config.min_speed >= 0, "min_speed", config.min_speed,
         "a finite number of 0 m/s or more");
}

template <int N>
void PassivityController<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  const bool seen = law_support::finite(interval) && interval.held > Duration::zero();
  last_ = seen ? interval : nothing_seen<N>();
  if (config_.observer == PassivityObserver::kZohExact) observed_ -= last_.applied.dot(last_.dx);
}

template <int N>
void PassivityController<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  last_ = nothing_seen<N>();
}

template <int N>
LimitedForce<N> PassivityController<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) {
    dissipated_ = 0;
    return law_support::refused<N>(kNoBound);
  }
  const double into_environment = -demand.force.dot(last_.dx);
  const bool same_sample = config_.observer == PassivityObserver::kSameSample;
  if (same_sample) observed_ += into_environment + dissipated_;
  const double missing = same_sample ? -observed_ : -(observed_ + into_environment);
  const double squared = last_.dx.squaredNorm();
  const double damping = series_damping(missing, squared, last_.held, config_.min_speed, config_.max_damping);
  dissipated_ = 0;
  if (damping == 0) return {demand.force, kNoBound, {}};
  const double per_motion = damping / seconds(last_.held);  // N/m
  dissipated_ = per_motion * squared;
  const Vec<N> force = demand.force - per_motion * last_.dx;
  if (!force.allFinite()) return law_support::refused<N>(kNoBound);
  return {force, kNoBound, Reason::kEnergy};
}

template <int N>
ParallelPassivityController<N>::ParallelPassivityController(const Config& config)
    : config_(config), port_(config.friction) {
  expect(config.max_mobility > 0, "max_mobility", config.max_mobility, "a number above 0 m/(N·s)");
  expect(std::isfinite(config.min_force) && config.min_force >= 0, "min_force", config.min_force,
         "a finite number of 0 N or more");
}

template <int N>
void ParallelPassivityController<N>::observe(const Interval<N>& interval) noexcept {
  port_.observe(interval.applied, interval.dx, interval.held);
  const bool seen = law_support::finite(interval) && interval.held > Duration::zero();
  last_ = seen ? interval : nothing_seen<N>();
  if (config_.observer == PassivityObserver::kZohExact) observed_ -= last_.applied.dot(last_.dx);
}

template <int N>
void ParallelPassivityController<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  port_.observe_unseen(applied.norm(), at_most);
  last_ = nothing_seen<N>();
}

template <int N>
LimitedForce<N> ParallelPassivityController<N>::limit(const Demand<N>& demand) noexcept {
  if (!law_support::finite(demand)) {
    dissipated_ = 0;
    slipped_.setZero();
    return law_support::refused<N>(kNoBound);
  }
  if (demand.force == Vec<N>::Zero() && demand.stiffness == Mat<N>::Zero()) offset_.setZero();
  Vec<N> force = demand.force + demand.stiffness * offset_;
  const double into_environment = -force.dot(last_.dx - slipped_);
  const bool same_sample = config_.observer == PassivityObserver::kSameSample;
  if (same_sample) observed_ += into_environment + dissipated_;
  const double missing = same_sample ? -observed_ : -(observed_ + into_environment);
  dissipated_ = 0;
  slipped_.setZero();
  const double squared = force.squaredNorm();
  if (missing > 0 && squared > config_.min_force * config_.min_force) {
    const double slip = std::min(missing / squared, config_.max_mobility * seconds(last_.held));  // m/N
    // Do not go beyond the point where the force of the environment is zero.
    const double stiffness = force.dot(demand.stiffness * force) / squared;
    slipped_ = -(stiffness * slip > 1 ? 1 / stiffness : slip) * force;
    dissipated_ = -force.dot(slipped_);
    offset_ += slipped_;
    force += demand.stiffness * slipped_;
  }
  if (!force.allFinite() || !offset_.allFinite()) {
    offset_.setZero();
    slipped_.setZero();
    return law_support::refused<N>(kNoBound);
  }
  return {force, kNoBound, force == demand.force ? Reasons() : Reasons(Reason::kEnergy)};
}

template class PassivityController<1>;
template class PassivityController<3>;
template class PassivityController<6>;
template class ParallelPassivityController<1>;
template class ParallelPassivityController<3>;
template class ParallelPassivityController<6>;

}  // namespace tendon
