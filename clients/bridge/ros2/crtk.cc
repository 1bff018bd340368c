// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/crtk.h"

#include <chrono>

namespace tendon::bridge {
namespace {

constexpr Duration kStateEvery = std::chrono::milliseconds(50);

constexpr const char* kWhoArms =
    "the operator arms the device, by the dead man's button of the scene or with tendon-dash; tendon-bridge never does";

bool is_faulty(const DeviceState& state) {
  return state.mode == Mode::kFault || Reasons::from_bits(state.reasons).has(Reason::kFault);
}
bool is_disarmed(const DeviceState& state) { return Reasons::from_bits(state.reasons).has(Reason::kDisarmed); }

}  // namespace

/// Returns nullopt if there was no report since the device was disarmed or had a fault.
std::optional<Safety> CrtkState::safety() {
  const auto report = bridged_.device_report();
  if (!report || report->until <= unsafe_since_) return {};
  return report->safety;
}

std::optional<RosOperatingState> CrtkState::message(LocalTime now, const RosHeader& header) {
  const std::string before = state_.state;
  const bool was_homed = state_.is_homed;
  const auto& state = bridged_.state();
  if (bridged_.lost() || !state) {
    if (!began_) return {};
    unsafe_since_ = PeerTime::min();  // another server has another clock
    state_.state = "FAULT";
    state_.is_homed = false;
  } else {
    began_ = true;
    if (is_faulty(*state) || is_disarmed(*state)) unsafe_since_ = state->sampled;
    const auto known = safety();
    const bool armed = known == Safety::kArmed || known == Safety::kUnguarded;
    state_.state = is_faulty(*state) || known == Safety::kFault ? "FAULT" : armed ? "ENABLED" : "DISABLED";
    if (known) state_.is_homed = armed || known == Safety::kHomed || known == Safety::kFault;
  }
  if (state_.state == "ENABLED") warning_.clear();
  if (state_.state == before && state_.is_homed == was_homed && now < next_) return {};
  next_ = now + kStateEvery;
  state_.header = header;
  return state_;
}

std::string CrtkState::take(std::string_view called, std::string_view command, LocalTime now) {
  const std::string asked = std::string(called) + " requested \"" + printable(command) + "\"";
  if (command == "enable") {
    if (state_.state == "ENABLED") return asked + ": the device is enabled already";
    warning_ = asked + ": " + kWhoArms;
    return warning_;
  }
  if (command == "disable") {
    warning_.clear();
    if (bridged_.state() && is_disarmed(*bridged_.state())) return asked + ": the device is disarmed already";
    return asked + (bridged_.disarm(now) ? ": the server is asked to disarm the device until the operator arms it"
                                         : ": refused, because of --observe");
  }
  return asked + ": refused; expected enable or disable";
}

void CrtkState::leave(std::string_view called) {
  if (warning_.starts_with(called)) warning_.clear();
}

}  // namespace tendon::bridge
