// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/bridge/ros2/ros2_device.h"
#include "clients/bridge/ros2/ros2_messages.h"

namespace tendon::bridge {

/// The DDS side of the bridge: one participant of Eclipse Cyclone DDS in one ROS domain. Topic `/a/b` is the DDS topic
/// `rt/a/b`. Types have the DDS names of ROS 2 types (ros2_types.idl). Data is CDR, XCDR1, without type information.
///
/// * Writers: reliable, keep last 1, volatile, max_blocking_time 0. They match all readers, and never block.
/// * Readers of forces and poses: best effort, keep last 1, volatile, so the newest message wins.
/// * Readers of `state_command`: reliable, keep last 10, volatile. Since they are volatile, they do not receive commands
///   that were sent before the bridge was started, even if the writer is transient local.
/// * The USER_DATA of each endpoint contains the hash of its type, "typehash=…;" (type_hash.h).
/// * Without Config::interface, only the loopback interface is used, with unicast discovery: participants of this
///   machine with the indices 0 … 99 are contacted once per second, and participants that use loopback are found
///   (ROS_LOCALHOST_ONLY=1). Otherwise the given interface is used with multicast, and unicast to Config::peers.
/// * CYCLONEDDS_URI is ignored, because it could expose the motors to more networks than the command line specifies.
///
/// The threads of DDS only write to `descriptor()`.
///
/// Thread-safe: no. Realtime-safe: no.
class Ros2Node {
 public:
  struct Config {
    std::uint32_t domain = 0;            ///< 0 … kMaxDomain
    std::string interface {};            ///< name such as "eth0"; empty: loopback
    std::vector<std::string> peers{};    ///< host names or addresses for unicast discovery
    std::vector<std::string> devices{};  ///< see ros_name()
    std::optional<RosServo::Kind> servo{};
    bool crtk = false;  ///< add the topics of CRTK, for example /NAME/measured_cp
  };
  static constexpr std::uint32_t kMaxDomain = 232;  ///< ports of higher domains would exceed 65535

  explicit Ros2Node(const Config& config);  ///< throws std::runtime_error with the reason of DDS if it fails
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

  int descriptor() const noexcept;  ///< readable after a message or a change of publishers, until clear()
  void clear();

  /// The new messages for the device: the newest force and pose of each topic, and all state commands.
  std::vector<RosInput> take(std::size_t device);
  /// Returns the publishers of these topics. If they have not changed since the last call, the result is empty.
  std::optional<std::vector<std::uint64_t>> writers_if_changed(std::size_t device);

  void publish(std::size_t device, const RosDevice::Messages& messages);
  void publish(const std::vector<RosDiagnosis>& diagnoses, RosTime stamp);

  std::uint64_t published() const noexcept;
  std::uint64_t unsent() const noexcept;      ///< messages that DDS did not accept immediately
  std::uint64_t superseded() const noexcept;  ///< messages that were replaced by a newer one before take()

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tendon::bridge
