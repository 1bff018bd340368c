// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "clients/bridge/bridged_device.h"
#include "clients/bridge/ros2/ros2_messages.h"

namespace tendon::bridge {

/// The operating state of one device, and the commands that change it, as defined by CRTK (Collaborative Robotics
/// Toolkit).
///
/// * The state is FAULT if there is a fault or if the session with the server is lost. It is ENABLED if the device is
///   armed or does not have a safety layer. Otherwise, it is DISABLED.
/// * The server reports the state of the safety layer once per second. After the device was disarmed or had a fault, the
///   state is DISABLED until the next report. It can therefore take one second until it is ENABLED.
/// * `disable` disarms the device. `enable` does not arm it, because this is the task of the operator. Instead, there is
///   a message, and /diagnostics contains a warning until the device is armed. Other commands are refused.
///
/// Thread-safe: no. Realtime-safe: no.
class CrtkState {
 public:
  /// `bridged` must outlive this object. Its configuration must include `always_observe` and `client.diagnostics`.
  explicit CrtkState(BridgedDevice& bridged) : bridged_(bridged) {}

  /// Returns a message if the state has changed, and at least 20 times per second. It is empty if the device has not
  /// sent a state yet. Call this after each turn of the BridgedDevice. The stamp of the header must be that of `now`.
  std::optional<RosOperatingState> message(LocalTime now, const RosHeader& header);

  /// Handles a `state_command` of the publisher `called`. Returns the message about it.
  std::string take(std::string_view called, std::string_view command, LocalTime now);

  void leave(std::string_view called);  ///< must be called if a publisher has left

  /// Returns the warning for /diagnostics, or an empty string if there is none.
  const std::string& warning() const noexcept { return warning_; }

 private:
  std::optional<Safety> safety();

  BridgedDevice& bridged_;
  RosOperatingState state_;
  LocalTime next_{};
  bool began_ = false;                       ///< a state of the device has arrived
  PeerTime unsafe_since_ = PeerTime::min();  ///< newest state that was disarmed or had a fault: older reports are void
  std::string warning_;
};

}  // namespace tendon::bridge
