// SPDX-License-Identifier: Apache-2.0
// This is only the DDS side of `tendon-bridge ros2`. On every topic, it publishes known values with time stamps at 1
// kHz. If it receives a wrench_command, it publishes a copy on `wrench`. It is used to test the message types and to
// measure the latency of DDS.
#include <poll.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>

#include "clients/bridge/ros2/ros2_node.h"
#include "clients/cpp/machine.h"

int main(int argc, char** argv) {
  using namespace tendon;          // NOLINT
  using namespace tendon::bridge;  // NOLINT
  if (argc != 3) {
    std::cerr << "usage: dds_floor DOMAIN SECONDS\n";
    return 2;
  }
  Ros2Node node({.domain = static_cast<std::uint32_t>(std::stoul(argv[1])),
                 .interface = {},
                 .peers = {},
                 .devices = {"device"},
                 .servo = RosServo::Kind::kPose});
  std::cout << R"({"event":"listening"})" << std::endl;
  RosDevice::Messages all;
  all.pose = RosPose{
      .header = {{}, "device_base"}, .position = {1, 2, 3}, .orientation = {.w = 0.5, .x = 0.1, .y = 0.2, .z = 0.3}};
  all.twist = RosTwist{.header = {{}, "device_base"}, .linear = {4, 5, 6}, .angular = {7, 8, 9}};
  all.joints =
      RosJointState{.header = {{}, "j"}, .name = {"waist", "elbow"}, .position = {0.25, -0.5}, .velocity = {1.5, 2.5}};
  all.joy = RosJoy{.header = {{}, "jo"}, .axes = {0.5F, 0.25F}, .buttons = {0, 1, 1}};
  all.servo.pose = RosPose{.header = {{}, "odd"}, .position = {-1, -2, -3}, .orientation = {}};
  const std::vector<RosDiagnosis> diagnoses = {{.level = RosDiagnosis::Level::kWarn,
                                                .name = "tendon: device",
                                                .message = "words",
                                                .hardware_id = "hw",
                                                .values = {{"key", "value"}, {"k", "v"}, {"", "empty key"}}}};
  LocalTime now = read_clock();
  const LocalTime end = now + std::chrono::seconds(std::stol(argv[2]));
  LocalTime next = now;
  for (std::uint64_t n = 0; now < end; now = read_clock()) {
    node.clear();
    if (const auto inputs = node.take(0); !inputs.empty()) {
      RosDevice::Messages answer;
      answer.wrench = inputs.back().wrench;
      node.publish(0, answer);
    }
    if (now >= next) {
      next += std::chrono::milliseconds(1);
      const auto system = std::chrono::system_clock::now().time_since_epoch();
      const RosTime stamp = ros_time(std::chrono::duration_cast<Duration>(system));
      all.pose->header.stamp = all.twist->header.stamp = all.joints->header.stamp = all.joy->header.stamp = stamp;
      all.servo.pose->header.stamp = stamp;
      node.publish(0, all);
      if (n++ % 100 == 0) node.publish(diagnoses, stamp);
    }
    const Duration left = std::max(next - read_clock(), Duration::zero());
    const timespec time{0, static_cast<long>(left.count())};
    std::array<pollfd, 1> bell = {{{node.descriptor(), POLLIN, 0}}};
    ::ppoll(bell.data(), bell.size(), &time, nullptr);
  }
  return 0;
}
