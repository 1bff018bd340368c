// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/passive_set_position.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/expect.h"

namespace tendon {

template <int N>
PassiveSetPosition<N>::PassiveSetPosition(const Config& config)
    : config_(config), ledger_(config.friction), stiffness_(config.stiffness), aim_(config.stiffness) {
  expect_above_zero(config.stiffness, "stiffness");
  expect_above_zero(seconds(config.longest_hold), "longest_hold");
  expect_not_negative(config.damping, "damping");
  double viscous = config.friction.viscous;
  if (const auto& bounded = config.bounded_acceleration) {
    expect_above_zero(bounded->most, "bounded_acceleration.most");
    expect(std::isfinite(bounded->shaping_viscous) && bounded->shaping_viscous >= viscous,
           "bounded_acceleration.shaping_viscous", bounded->shaping_viscous,
           "the viscous friction of " + shortest(viscous) + " N·s/m or more");
    viscous = bounded->shaping_viscous;
  }
  const double most = 2 * viscous / seconds(config.longest_hold);
  expect(config.stiffness <= most * (1 + 1e-12), "stiffness", config.stiffness,  // 2b/T itself, however it was rounded
         "at most 2 b / T_max = " + shortest(most) + " N/m");
  bound_ = OutputBound::of(config.friction, config.longest_hold);
}

template <int N>
void PassiveSetPosition<N>::receive(const SetPosition<N>& message) noexcept {
  if (message.sequence > newest_.sequence && message.position.allFinite()) newest_ = message;
}

template <int N>
void PassiveSetPosition<N>::loop_delay(Duration round_trip) noexcept {
  if (config_.damping == 0 || round_trip < Duration::zero()) return;
  aim_ = config_.stiffness;
  const double delay = seconds(round_trip);
  if (aim_ * delay > 2 * config_.damping) aim_ = 2 * config_.damping / delay;
}

template <int N>
void PassiveSetPosition<N>::forget_velocity() noexcept {
  velocity_.reset();
  acceleration_holds_ = false;
}

template <int N>
void PassiveSetPosition<N>::observe(const Interval<N>& interval) noexcept {
  ledger_.observe(interval.applied, interval.dx, interval.held);
  if (!config_.bounded_acceleration) return;
  const double held = seconds(interval.held);
  if (!interval.applied.allFinite() || !interval.dx.allFinite() || !(held > 0)) {
    forget_velocity();
    return;
  }
  const Vec<N> velocity = interval.dx / held;
  acceleration_holds_ = false;
  if (velocity_) {
    const double most = config_.bounded_acceleration->most * (held + seconds(last_held_)) / 2;
    acceleration_holds_ = (velocity - *velocity_).norm() <= most * (1 + 1e-9);  // at the limit, however it was rounded
    if (!acceleration_holds_) ++broken_;
  }
  velocity_ = velocity;
  last_held_ = interval.held;
}

template <int N>
void PassiveSetPosition<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  ledger_.observe_unseen(applied.norm(), at_most);
  forget_velocity();
}

// N, the most that ‖force‖ may be in this direction.
template <int N>
double PassiveSetPosition<N>::permitted(const Vec<N>& force) const noexcept {
  OutputBound bound = bound_;
  const double size = force.norm();
  if (!acceleration_holds_ || !(size > 0)) return bound.largest(ledger_.energy());
  const double hold = seconds(config_.longest_hold);
  const double towards = velocity_->dot(force) / size;
  bound.reach = hold * (towards + config_.bounded_acceleration->most * (seconds(last_held_) + hold) / 2);
  OutputBound shaping = bound_;
  shaping.viscous_per_hold = config_.bounded_acceleration->shaping_viscous / hold;
  return std::min(bound.largest(ledger_.energy()), shaping.largest(ledger_.energy()));
}

template <int N>
Demand<N> PassiveSetPosition<N>::command(const Vec<N>& position, const Vec<N>& velocity) noexcept {
  constexpr double kSettling = 0.1;  // s
  const double step = std::min(seconds(config_.longest_hold) / kSettling, 1.0);
  stiffness_ += step * (aim_ - stiffness_);
  if (newest_.sequence == 0) return {0 * (position + velocity)};  // not finite when one of them is not
  const Vec<N> stretch = paid_stretch<N>(newest_.position - position, stiffness_, ledger_.energy());
  Vec<N> force = stiffness_ * stretch - config_.damping * velocity;
  if (config_.damping > 0 || config_.bounded_acceleration) {
    const double most = permitted(force);
    const double size = force.norm();
    if (size > most) force *= most / size;
  }
  return {force, stiffness_ * Mat<N>::Identity()};
}

template class PassiveSetPosition<1>;
template class PassiveSetPosition<3>;
template class PassiveSetPosition<6>;

}  // namespace tendon
