// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/two_channel_passivity.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

template <int N>
PassivityLeader<N>::PassivityLeader(const Config& config) : config_(config) {
  expect_above_zero(config.max_damping, "max_damping");
  expect_above_zero(seconds(config.period), "period");
}

template <int N>
void PassivityLeader<N>::receive(const FollowerMessage<N>& message) noexcept {
  if (message.sequence <= newest_.sequence) return;
  if (message.force.allFinite() && std::isfinite(message.energy_in)) newest_ = message;
}

template <int N>
Demand<N> PassivityLeader<N>::command(const Vec<N>& velocity) noexcept {
  const double excess = newest_.force.dot(velocity) - energy() / seconds(config_.period);  // W
  if (excess <= 0) return {newest_.force};
  const double squared = velocity.squaredNorm();
  const double damping = excess < config_.max_damping * squared ? excess / squared : config_.max_damping;
  return {newest_.force - damping * velocity};
}

template <int N>
LeaderMessage<N> PassivityLeader<N>::observe(const Interval<N>& interval) noexcept {
  ++sent_.sequence;
  sent_.velocity.setZero();
  if (interval.held <= Duration::zero() || !interval.applied.allFinite() || !interval.dx.allFinite()) return sent_;
  const double out = interval.applied.dot(interval.dx);
  (out > 0 ? out_ : sent_.energy_in) += std::abs(out);
  sent_.velocity = interval.dx / seconds(interval.held);
  sent_.displacement += interval.dx;
  return sent_;
}

template <int N>
PassivityFollower<N>::PassivityFollower(const Config& config) : config_(config) {
  expect_not_negative(config.drift_rate, "drift_rate");
  expect_not_negative(config.stiffness, "stiffness");
  expect_above_zero(seconds(config.period), "period");
}

template <int N>
void PassivityFollower<N>::receive(const LeaderMessage<N>& message) noexcept {
  if (message.sequence <= newest_.sequence) return;
  if (!message.velocity.allFinite() || !message.displacement.allFinite() || !std::isfinite(message.energy_in)) return;
  newest_ = message;
  fresh_ = true;
}

template <int N>
void PassivityFollower<N>::begin(const Vec<N>& displacement) noexcept {
  displacement_ = newest_.displacement = displacement;
  fresh_ = false;
}

template <int N>
auto PassivityFollower<N>::step(const Vec<N>& force) noexcept -> Command {
  const double period = seconds(config_.period);
  ++sent_.sequence;
  if (!force.allFinite()) return {Vec<N>::Zero(), sent_};

  Vec<N> velocity = fresh_ ? newest_.velocity : Vec<N>::Zero();
  fresh_ = false;
  velocity += config_.drift_rate * (newest_.displacement - displacement_ - period * velocity);
  const double spring = 0.5 * config_.stiffness * period;   // the spring stores ½K T² v²; in W, per v²
  const double allowed = std::max(energy(), 0.0) / period;  // W
  const double excess = force.dot(velocity) + spring * velocity.squaredNorm() - allowed;
  if (excess > 0 && spring > 0) {
    // The condition is a ball with radius r around −f/(K T); |from_centre|² − r² = excess / spring.
    const Vec<N> from_centre = velocity + force / (2 * spring);
    const double distance = from_centre.norm();
    const double beyond = excess / spring;
    const double radius = std::sqrt(std::max(distance * distance - beyond, 0.0));
    velocity -= beyond / (distance * (distance + radius)) * from_centre;
  } else if (excess > 0 && force.squaredNorm() > 0) {
    velocity -= excess / force.squaredNorm() * force;
  }

  const double out = period * (force.dot(velocity) + spring * velocity.squaredNorm());
  (out > 0 ? out_ : sent_.energy_in) += std::abs(out);
  displacement_ += period * velocity;
  sent_.force = -force;
  return {velocity, sent_};
}

template class PassivityLeader<1>;
template class PassivityLeader<3>;
template class PassivityLeader<6>;
template class PassivityFollower<1>;
template class PassivityFollower<3>;
template class PassivityFollower<6>;

}  // namespace tendon
