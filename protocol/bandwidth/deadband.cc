// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/deadband.h"

#include <algorithm>

#include "core/base/rotation.h"
#include "protocol/expect.h"
#include "protocol/limits.h"

namespace tendon {

Deadband::Deadband(const Config& config) : config_(config) {
  expect(config.share >= 0 && config.share <= 1, "deadband.share", config.share, "0 to 1");
  expect(config.floor >= 0, "deadband.floor", config.floor, "0 or more");
  expect_above_zero(seconds(config.longest_silence), "deadband.longest_silence_s");
}

bool Deadband::differs(LocalTime now, const Vec3& value) const noexcept {
  const bool imperceptible =
      sent_ && now - sent_->at < config_.longest_silence &&
      (value - sent_->value).norm() <= std::max(config_.share * sent_->value.norm(), config_.floor);
  return !imperceptible;  // also true for NaN
}

bool Deadband::passes(LocalTime now, const Vec3& value) noexcept {
  if (!differs(now, value)) return false;
  sent(now, value);
  return true;
}

namespace {

Deadband::Config with_floor(Deadband::Config config, double floor) {
  config.floor = floor;
  return config;
}

Vec3 grip_of(const HandleDeadband::Value& value) noexcept { return {value.grip.value_or(0), 0, 0}; }

}  // namespace

HandleDeadband::HandleDeadband(const Deadband::Config& vector, double turning_floor, double grip_floor)
    : vector_(vector), turning_(with_floor(vector, turning_floor)), grip_(with_floor(vector, grip_floor)) {}

bool HandleDeadband::passes(LocalTime now, const Value& value) noexcept {
  const bool same_parts = turns_ == value.turning.has_value() && grips_ == value.grip.has_value();
  if (same_parts && !vector_.differs(now, value.vector) &&
      !turning_.differs(now, value.turning.value_or(Vec3::Zero())) && !grip_.differs(now, grip_of(value))) {
    return false;
  }
  sent(now, value);
  return true;
}

void HandleDeadband::sent(LocalTime now, const Value& value) noexcept {
  turns_ = value.turning.has_value();
  grips_ = value.grip.has_value();
  vector_.sent(now, value.vector);
  turning_.sent(now, value.turning.value_or(Vec3::Zero()));
  grip_.sent(now, grip_of(value));
}

DeviceState predict(const DeviceState& sent, Duration later, Duration haptic_period) noexcept {
  const Duration::rep periods = std::max<Duration::rep>(later / haptic_period, 0);
  DeviceState state = sent;
  state.tick += static_cast<std::uint64_t>(periods);
  state.sampled += periods * haptic_period;
  const double time = seconds(periods * haptic_period);
  state.position += time * sent.velocity;
  if (periods > 0 && state.turning) {
    Turning& turning = *state.turning;
    turning.orientation = unit(product(rotation_by(time * turning.angular_velocity), turning.orientation));
  }
  if (state.grip) state.grip->opening += time * state.grip->velocity;
  return state;
}

std::string StateDeadband::objection(const SetStateDeadband& asked) {
  if (asked.max_silence == Duration::zero()) return {};
  if (!(asked.share >= 0 && asked.share <= limits::kMaxDeadbandShare)) return "share: expected 0 to 0.5";
  if (!(asked.floor >= 0 && asked.floor <= limits::kMaxDeadbandFloor)) return "floor_mps: expected 0 to 0.1";
  if (asked.max_silence < limits::kMinStateSilence || asked.max_silence > limits::kMaxStateSilence) {
    return "max_silence_us: expected 0, or 1000 to 20000";
  }
  return {};
}

StateDeadband::StateDeadband(const SetStateDeadband& asked)
    : velocity_(HandleDeadband::of_velocities(
          {.share = asked.share, .floor = asked.floor, .longest_silence = asked.max_silence})) {}

bool StateDeadband::passes(const DeviceState& state) noexcept {
  const LocalTime now(state.sampled.time_since_epoch());
  HandleDeadband::Value velocity{.vector = state.velocity};
  if (state.turning) velocity.turning = state.turning->angular_velocity;
  if (state.grip) velocity.grip = state.grip->velocity;
  if (mode_ == state.mode && buttons_ == state.buttons) return velocity_.passes(now, velocity);
  mode_ = state.mode;
  buttons_ = state.buttons;
  velocity_.sent(now, velocity);
  return true;
}

}  // namespace tendon
