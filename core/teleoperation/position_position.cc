// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/position_position.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

template <int N>
PositionPosition<N>::PositionPosition(const Config& config) : config_(config), stiffness_(config.stiffness) {
  expect_above_zero(config.stiffness, "stiffness");
  expect_not_negative(config.damping, "damping");
  expect_not_negative(config.own_damping, "own_damping");
  if (config.adapt_to_delay) {
    expect(config.own_damping > 0, "own_damping", config.own_damping,
           "a number above 0 N·s/m, because adapt_to_delay lowers the stiffness to 2 B over the round trip");
  }
  expect_above_zero(seconds(config.period), "period");
  expect_above_zero(seconds(config.recovery), "recovery");
  expect(config.max_force > 0, "max_force", config.max_force, "a number above 0 N, or infinity");
}

template <int N>
void PositionPosition<N>::receive(const PortMotion<N>& message) noexcept {
  if (!message.position.allFinite() || !message.velocity.allFinite() || message.answers > sequence_) {
    ++refused_;
    return;
  }
  if (message.sequence > newest_.sequence) newest_ = message;
}

template <int N>
Demand<N> PositionPosition<N>::command(const Vec<N>& position, const Vec<N>& velocity) noexcept {
  ++sequence_;
  position_ = position;
  velocity_ = velocity;
  Vec<N> force = -config_.own_damping * velocity;
  if (newest_.sequence == 0) return {force + 0 * position};  // not finite when the position is not
  if (newest_.answers > 0) {
    const double period = seconds(config_.period);
    const double loop = static_cast<double>(sequence_ - newest_.answers) * period;
    const double fallen = loop_ + (loop - loop_) * std::min(1.0, period / seconds(config_.recovery));
    loop_ = std::max(loop, fallen);
  }
  stiffness_ = config_.stiffness;
  if (config_.adapt_to_delay && loop_ > 0) stiffness_ = std::min(stiffness_, 2 * config_.own_damping / loop_);
  force += stiffness_ * (newest_.position - position) + config_.damping * (newest_.velocity - velocity);
  const double size = force.stableNorm();
  if (size > config_.max_force) force *= config_.max_force / size;
  return {force, stiffness_ * Mat<N>::Identity()};
}

template class PositionPosition<1>;
template class PositionPosition<3>;
template class PositionPosition<6>;

}  // namespace tendon
