// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/igtl/igtl_station.h"

#include <algorithm>

namespace tendon::bridge::igtl {
namespace {

/// While a program gains or loses control of the device, there is no state for a few round trips.
constexpr Duration kLostAfter = std::chrono::milliseconds(250);

std::pair<Status, std::string> status_of(const BridgedDevice& bridged) {
  if (!bridged.state()) return {Status::kConnectionLost, "no state from the Tendon server"};
  const DeviceState& state = *bridged.state();
  const Reasons reasons = Reasons::from_bits(state.reasons);
  if (state.mode == Mode::kFault || reasons.has(Reason::kFault)) {
    return {Status::kHardwareFailure, "no force because of a fault; the operator has to rearm the device"};
  }
  if (reasons.has(Reason::kDisarmed)) return {Status::kDisabled, "no force because the device is disarmed"};
  return {Status::kOk, "ready"};
}

std::string_view words_of(Mode mode) {
  switch (mode) {
    case Mode::kIdle:
      return "idle";
    case Mode::kActive:
      return "active";
    case Mode::kHolding:
      return "holding";
    case Mode::kDecaying:
      return "decaying";
    case Mode::kSafeStop:
      return "stopped";
    case Mode::kFault:
      return "fault";
  }
  return "unknown";
}

std::string state_in_words(const DeviceState& state, std::uint32_t buttons) {
  std::string words = "force " + std::string(words_of(state.mode)) + "; buttons";
  if (buttons == 0) words += " none";
  for (unsigned i = 0; i < 32; ++i) {
    if ((buttons >> i & 1U) != 0) words += " " + std::to_string(i);
  }
  const std::string reasons = to_string(Reasons::from_bits(state.reasons));
  return words + "; limits " + (reasons.empty() ? "none" : reasons);
}

}  // namespace

Station::Station(Config config)
    : config_(std::move(config)),
      force_(config_.name + "Force"),
      state_(config_.name + "State"),
      command_(config_.name + "Command") {
  if (config_.target.empty()) config_.target = config_.name + "Target";
}

Bytes Station::turn(const Moment& now, const BridgedDevice& bridged) {
  due_.clear();
  const Label label{config_.name, now.since_1970};
  bool changed = false;
  if (bridged.state()) alive_ = now.at;
  const bool is_known = bridged.state() || now.at - alive_ >= kLostAfter;
  if (auto [status, text] = status_of(bridged); is_known && text != told_status_) {
    status_.clear();
    append_status(status_, label, status, text);
    due_ = status_;
    told_status_ = std::move(text);
    if (status == Status::kConnectionLost) {
      string_.clear();
      told_state_.clear();
    }
    changed = true;
  }
  if (bridged.state() && bridged.states() != seen_) {
    seen_ = bridged.states();
    buttons_ |= bridged.state()->buttons;
    if (now.at >= next_) {
      const Duration period = from_seconds(1 / config_.rate_hz);
      next_ = std::max(next_ + period, now.at + period / 2);
      report(now, bridged);
      if (std::string text = state_in_words(*bridged.state(), buttons_); text != told_state_) {
        string_.clear();
        append_string(string_, {state_, now.since_1970}, text);
        due_.insert(due_.end(), string_.begin(), string_.end());
        told_state_ = std::move(text);
        changed = true;
      }
      buttons_ = 0;
    }
  }
  if (changed) {
    greeting_ = status_;
    greeting_.insert(greeting_.end(), string_.begin(), string_.end());
  }
  return due_;
}

void Station::report(const Moment& now, const BridgedDevice& bridged) {
  const DeviceState& state = *bridged.state();
  const View here = view(bridged);
  const Duration since_1970 = now.since_1970 - (now.at - bridged.sampled());
  const Mat3 rotation = state.turning ? here.orientation(state.turning->orientation) : Mat3(Mat3::Identity());
  const Vec3 force = here.force(state.force_applied);
  append_transform(due_, {config_.name, since_1970}, rotation, here.position(state.position));
  append_force(due_, {force_, since_1970}, force);
  append_transform(due_, {force_, since_1970}, Mat3::Identity(), force);
  ++reports_;
}

}  // namespace tendon::bridge::igtl
