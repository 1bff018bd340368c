// SPDX-License-Identifier: Apache-2.0
#include "protocol/narrow/deadband.h"

#include <algorithm>

#include "protocol/expect.h"
#include "protocol/limits.h"

namespace tendon {

Deadband::Deadband(const Config& config) : config_(config) {
  expect(config.share >= 0 && config.share <= 1, "deadband.share", config.share, "0 to 1");
  expect(config.floor >= 0, "deadband.floor", config.floor, "0 or more");
  expect_above_zero(seconds(config.longest_silence), "deadband.longest_silence_s");
}

bool Deadband::passes(LocalTime now, const Vec3& value) noexcept {
  const bool imperceptible =
      sent_ && now - sent_->at < config_.longest_silence &&
      (value - sent_->value).norm() <= std::max(config_.share * sent_->value.norm(), config_.floor);
  if (imperceptible) return false;  // false when `value` is not a number: that passes
  sent(now, value);
  return true;
}

DeviceState foretell(const DeviceState& sent, Duration later, Duration haptic_period) noexcept {
  const Duration::rep periods = std::max<Duration::rep>(later / haptic_period, 0);
  DeviceState state = sent;
  state.tick += static_cast<std::uint64_t>(periods);
  state.sampled += periods * haptic_period;
  state.position += seconds(periods * haptic_period) * sent.velocity;
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
    : velocity_({.share = asked.share, .floor = asked.floor, .longest_silence = asked.max_silence}) {}

bool StateDeadband::passes(const DeviceState& state) noexcept {
  const LocalTime now(state.sampled.time_since_epoch());
  if (mode_ == state.mode && buttons_ == state.buttons) return velocity_.passes(now, state.velocity);
  mode_ = state.mode;
  buttons_ = state.buttons;
  velocity_.sent(now, state.velocity);
  return true;
}

}  // namespace tendon
