// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/position_position.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

namespace {

/// s/s, faster than the drift between two clocks, so that the minimum adapts to a longer delay within seconds.
constexpr double kFloorRise = 2e-3;

/// 36 years, so that the difference of two times cannot overflow.
constexpr Duration kMostMotionTime = std::chrono::nanoseconds(std::int64_t{1} << 60);

}  // namespace

template <int N>
PositionPosition<N>::PositionPosition(const Config& config)
    : config_(config),
      stiffness_({.most = config.stiffness,
                  .damping = config.adapt_to_delay ? config.own_damping : std::numeric_limits<double>::infinity(),
                  .period = config.period}) {
  expect_above_zero(config.stiffness, "stiffness");
  expect_not_negative(config.damping, "damping");
  expect_not_negative(config.own_damping, "own_damping");
  if (config.adapt_to_delay) {
    expect(config.own_damping > 0, "own_damping", config.own_damping,
           "a number above 0 N·s/m, because adapt_to_delay limits the stiffness to 2 B divided by the round-trip time");
  }
  expect_above_zero(seconds(config.period), "period");
  expect_above_zero(seconds(config.recovery), "recovery");
  expect(config.epoch > 0, "epoch", static_cast<double>(config.epoch), "a number above 0");
  expect(config.max_force > 0, "max_force", config.max_force, "a number above 0 N, or infinity");
}

template <int N>
void PositionPosition<N>::renew(std::uint64_t epoch) noexcept {
  config_.epoch = epoch;
  newest_ = {};
  forget_round_trip();
  stiffness_.forget();
}

template <int N>
void PositionPosition<N>::become(double stiffness, double damping, double own_damping) noexcept {
  config_.stiffness = stiffness;
  config_.damping = damping;
  config_.own_damping = own_damping;
  stiffness_.become(stiffness, config_.adapt_to_delay ? own_damping : std::numeric_limits<double>::infinity());
}

template <int N>
void PositionPosition<N>::receive(const PortMotion<N>& message) noexcept {
  const bool answered = message.answers_epoch == config_.epoch;
  if (!message.position.allFinite() || !message.velocity.allFinite() || message.epoch == 0 || message.sequence == 0 ||
      message.time < -kMostMotionTime || message.time > kMostMotionTime || message.round_trip < Duration::zero() ||
      (answered && message.answers > sequence_)) {
    ++refused_;
    return;
  }
  if (newest_.sequence > 0) {
    if (message.epoch < newest_.epoch) return;
    if (message.epoch == newest_.epoch && message.sequence <= newest_.sequence) return;
  }
  if (newest_.sequence == 0 || message.epoch > newest_.epoch) {
    floor_ = std::numeric_limits<double>::infinity();
    forget_round_trip();
    stiffness_.forget();
  }
  newest_ = message;
  if (!answered) newest_.answers = 0;
}

template <int N>
void PositionPosition<N>::forget_round_trip() noexcept {
  loop_ = loop_before_ = Duration::zero();
  stretch_began_ = sequence_;
}

template <int N>
Demand<N> PositionPosition<N>::command(const Vec<N>& position, const Vec<N>& velocity, double energy) noexcept {
  ++sequence_;
  position_ = position;
  velocity_ = velocity;
  Vec<N> force = -config_.own_damping * velocity;
  if (newest_.sequence == 0) return {force + 0 * position};  // propagates a position that is not finite
  const auto counted = [this](std::uint64_t periods) { return static_cast<std::int64_t>(periods) * config_.period; };
  if (newest_.answers > 0) {
    if (counted(sequence_ - stretch_began_) >= config_.recovery) {
      stretch_began_ = sequence_;
      loop_before_ = std::exchange(loop_, Duration::zero());
    }
    loop_ = std::max(loop_, counted(sequence_ - newest_.answers));
  }
  const double stiffness = stiffness_.follow(round_trip());

  const double lag = seconds(counted(sequence_) - newest_.time);
  floor_ = std::min(lag, floor_ + kFloorRise * seconds(config_.period));
  const double late = lag - floor_;
  ahead_ = std::min(late, seconds(kMostAhead));
  const Vec<N> there = newest_.position + ahead_ * newest_.velocity;
  const Vec<N> speed = late > ahead_ ? Vec<N>(Vec<N>::Zero()) : newest_.velocity;
  force += stiffness * paid_stretch<N>(there - position, stiffness, energy) + config_.damping * (speed - velocity);
  if (std::isfinite(config_.max_force)) {
    const double size = force.stableNorm();
    if (size > config_.max_force) force *= config_.max_force / size;
  }
  return {force, stiffness * Mat<N>::Identity()};
}

template <int N>
PortMotion<N> PositionPosition<N>::message() const noexcept {
  const bool heard = newest_.sequence > 0;
  return {.epoch = config_.epoch,
          .sequence = sequence_,
          .answers_epoch = heard ? newest_.epoch : 0,
          .answers = newest_.sequence,
          .time = static_cast<std::int64_t>(sequence_) * config_.period,
          .round_trip = std::max(loop_, loop_before_),
          .position = position_,
          .velocity = velocity_};
}

template class PositionPosition<1>;
template class PositionPosition<3>;
template class PositionPosition<6>;

}  // namespace tendon
