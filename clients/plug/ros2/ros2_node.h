// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/plug/ros2/ros2_device.h"
#include "clients/plug/ros2/ros2_messages.h"

namespace tendon::plug {

/// The DDS end of the bridge: one participant of Eclipse Cyclone DDS in one ROS domain. Topic `/a/b` is DDS topic
/// `rt/a/b`; types have ROS 2's names in DDS (ros2_types.idl); data are CDR, XCDR1, without type information.
///
/// * Writers: reliable, keep last 1, volatile, max_blocking_time 0. They match reliable and best-effort readers, keep
///   one message for those who are slow, and never wait for one.
/// * Readers of `wrench_command`: best effort, keep last 1, volatile: newest wins.
/// * Without Config::interface all is on the loopback, by unicast: the participants of this machine with the indices
///   0 … 99 are greeted once a second, and those that announce the loopback are found (ROS_LOCALHOST_ONLY=1). With one,
///   it is that interface with multicast, and with the unicast of Config::peers.
/// * CYCLONEDDS_URI is not heeded: it would let the motors be reached from more than was said on the command line.
///
/// DDS has threads of its own; they write to `descriptor()` and do nothing else of ours.
///
/// Thread-safe: no. Realtime-safe: no.
class Ros2Node {
 public:
  struct Config {
    std::uint32_t domain = 0;            ///< 0 … kMaxDomain
    std::string interface {};            ///< a name like "eth0"; empty: the loopback
    std::vector<std::string> peers{};    ///< host names or addresses, asked by unicast
    std::vector<std::string> devices{};  ///< see ros_name()
    std::optional<RosServo::Kind> servo{};
  };
  static constexpr std::uint32_t kMaxDomain = 232;  ///< the ports of higher ones do not exist

  /// Throws std::runtime_error, with DDS's reason, when there can be no participant.
  explicit Ros2Node(const Config& config);
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

  /// Readable once a command has come or a publisher has come or left, until clear().
  int descriptor() const noexcept;
  void clear();

  struct Command {
    std::uint64_t writer = 0;
    std::string called;  ///< for people
    RosWrench wrench;
  };
  /// The newest command for the device; empty: nothing new.
  std::optional<Command> take(std::size_t device);
  /// Who publishes commands for the device; empty: the same as when it was asked last.
  std::optional<std::vector<std::uint64_t>> writers_if_changed(std::size_t device);

  void publish(std::size_t device, const RosDevice::Messages& messages);
  void publish(const std::vector<RosDiagnosis>& diagnoses, RosTime stamp);

  std::uint64_t published() const noexcept;
  std::uint64_t unsent() const noexcept;      ///< messages that DDS did not take at once
  std::uint64_t superseded() const noexcept;  ///< commands that a newer one has replaced before it was taken

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tendon::plug
