// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/position_position.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

namespace {

/// s per s: faster than two clocks drift apart, so the floor finds a way that has become longer within seconds.
constexpr double kFloorRise = 2e-3;

}  // namespace

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
  if (!message.position.allFinite() || !message.velocity.allFinite() || message.answers > sequence_ ||
      message.round_trip < Duration::zero()) {
    ++refused_;
    return;
  }
  if (message.sequence <= newest_.sequence) return;
  if (newest_.sequence == 0) floor_ = std::numeric_limits<double>::infinity();
  newest_ = message;
}

template <int N>
Demand<N> PositionPosition<N>::command(const Vec<N>& position, const Vec<N>& velocity) noexcept {
  ++sequence_;
  position_ = position;
  velocity_ = velocity;
  Vec<N> force = -config_.own_damping * velocity;
  if (newest_.sequence == 0) return {force + 0 * position};  // not finite when the position is not
  const double period = seconds(config_.period);
  if (newest_.answers > 0) {
    if (static_cast<double>(sequence_ - stretch_began_) * period >= seconds(config_.recovery)) {
      stretch_began_ = sequence_;
      loop_before_ = std::exchange(loop_, 0);
    }
    loop_ = std::max(loop_, static_cast<double>(sequence_ - newest_.answers) * period);
  }
  stiffness_ = config_.stiffness;
  const double loop = seconds(round_trip());
  if (config_.adapt_to_delay && loop > 0) stiffness_ = std::min(stiffness_, 2 * config_.own_damping / loop);

  const double lag = static_cast<double>(sequence_) * period - seconds(newest_.time);
  floor_ = std::min(lag, floor_ + kFloorRise * period);
  const double late = lag - floor_;
  const double ahead = std::min(late, seconds(kMostAhead));
  const Vec<N> there = newest_.position + ahead * newest_.velocity;
  const Vec<N> speed = late > ahead ? Vec<N>(Vec<N>::Zero()) : newest_.velocity;
  force += stiffness_ * (there - position) + config_.damping * (speed - velocity);
  const double size = force.stableNorm();
  if (size > config_.max_force) force *= config_.max_force / size;
  return {force, stiffness_ * Mat<N>::Identity()};
}

template <int N>
PortMotion<N> PositionPosition<N>::message() const noexcept {
  return {.sequence = sequence_,
          .answers = newest_.sequence,
          .time = from_seconds(static_cast<double>(sequence_) * seconds(config_.period)),
          .round_trip = from_seconds(std::max(loop_, loop_before_)),
          .position = position_,
          .velocity = velocity_};
}

template class PositionPosition<1>;
template class PositionPosition<3>;
template class PositionPosition<6>;

}  // namespace tendon
