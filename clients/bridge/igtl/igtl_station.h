// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "clients/bridge/bridge_loop.h"
#include "clients/bridge/bridged_device.h"
#include "clients/bridge/igtl/igtl_message.h"
#include "clients/bridge/view.h"

namespace tendon::bridge::igtl {

/// A device as OpenIGTLink programs see it. Positions are in mm in the frame of Config.
///
///     NAME         TRANSFORM   pose of the handle, at rate_hz; the rotation is the identity if it is not measured
///     NAMEForce    SENSOR      force that the device applies on the hand, N, at rate_hz
///     NAMEForce    TRANSFORM   the same as a position, 1 mm per N, at rate_hz
///     NAME         STATUS      whether the device is connected, disarmed or has a fault, on change
///     NAMEState    STRING      freshness of the force, held buttons and reasons for limits, on change, at rate_hz
///     NAMETarget   TRANSFORM   (input) position to which a spring pulls the hand
///     NAMECommand  SENSOR      (input) force on the hand
///
/// The time stamp of a pose or a force is the time when the device measured it. Thread-safe: no. Realtime-safe: no.
class Station {
 public:
  static constexpr std::size_t kLongestName = igtl::kLongestName - 1 - std::string_view("Command").size();

  struct Config {
    std::string name;    ///< at most kLongestName bytes
    std::string target;  ///< name of the input with the position; empty: NAMETarget
    Frame frame;         ///< in mm
    double rate_hz = 60;
    double stiffness = 200;  ///< N/m, of the spring
  };
  explicit Station(Config config);

  const std::string& name() const noexcept { return config_.name; }
  const std::string& target() const noexcept { return config_.target; }
  const std::string& command() const noexcept { return command_; }
  double stiffness() const noexcept { return config_.stiffness; }
  View view(const BridgedDevice& bridged) const {
    return {config_.frame, bridged.handle() ? bridged.handle()->operator_from_device : std::nullopt};
  }

  /// Returns the messages that are due. Call this after each turn of the BridgedDevice.
  Bytes turn(const Moment& now, const BridgedDevice& bridged);
  /// The newest STATUS and STRING, for a program that has connected or sent GET_STATUS.
  Bytes greeting() const noexcept { return greeting_; }
  std::uint64_t reports() const noexcept { return reports_; }  ///< poses

 private:
  void report(const Moment& now, const BridgedDevice& bridged);

  Config config_;
  std::string force_;
  std::string state_;
  std::string command_;
  std::string told_status_;
  std::string told_state_;
  Buffer status_;
  Buffer string_;
  Buffer greeting_;
  Buffer due_;
  std::uint64_t seen_ = 0;
  std::uint32_t buttons_ = 0;  ///< pressed since the last report
  LocalTime next_{};
  LocalTime alive_{};  ///< newest time with a state
  std::uint64_t reports_ = 0;
};

}  // namespace tendon::bridge::igtl
