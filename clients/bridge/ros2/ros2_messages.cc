// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_messages.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tendon::bridge {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::size_t kMostPrinted = 64;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word(char c) { return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

}  // namespace

std::string_view topic_name(RosInput::Topic topic) {
  switch (topic) {
    case RosInput::Topic::kWrenchCommand:
      return "wrench_command";
    case RosInput::Topic::kServoCf:
      return "servo_cf";
    case RosInput::Topic::kServoCp:
      return "servo_cp";
    case RosInput::Topic::kStateCommand:
      return "state_command";
  }
  return "?";
}

RosTime ros_time(Duration since_1970) {
  return {.sec = static_cast<std::int32_t>(since_1970.count() / kNanoseconds),
          .nanosec = static_cast<std::uint32_t>(since_1970.count() % kNanoseconds)};
}

std::string ros_name(std::string_view device) {
  std::string name(device);
  std::ranges::replace_if(
      name, [](char c) { return !is_word(c); }, '_');
  return name.empty() || is_digit(name.front()) ? "_" + name : name;
}

std::string printable(std::string_view text) {
  std::string all(text.substr(0, kMostPrinted));
  std::ranges::replace_if(
      all, [](char c) { return c < ' ' || c > '~'; }, '?');
  return all;
}

RosView::RosView(std::string_view name, const std::optional<Quat>& operator_from_device)
    : base_(*find_frame("ros"), operator_from_device),
      operator_(*find_frame("operator"), operator_from_device),
      base_id_(std::string(name) + "_base"),
      operator_id_(std::string(name) + "_operator") {}

RosPose RosView::pose(const DeviceState& state, RosTime stamp) const {
  return {.header = {stamp, base_id_},
          .position = base_.position(state.position),
          .orientation = state.turning ? quaternion_of(base_.orientation(state.turning->orientation)) : Quat{}};
}

RosTwist RosView::twist(const DeviceState& state, RosTime stamp) const {
  return {.header = {stamp, base_id_},
          .linear = base_.position(state.velocity),
          .angular = state.turning ? base_.torque(state.turning->angular_velocity) : Vec3(Vec3::Zero())};
}

RosWrench RosView::wrench(const DeviceState& state, RosTime stamp) const {
  return {.header = {stamp, base_id_},
          .force = base_.force(state.force_applied),
          .torque = state.torque_applied ? base_.torque(*state.torque_applied) : Vec3(Vec3::Zero())};
}

std::variant<RosView::Wish, std::string> RosView::wish(const RosWrench& command, bool negate) const {
  const std::string& frame = command.header.frame_id;
  const bool of_operator = frame == operator_id_;
  if (!of_operator && !frame.empty() && frame != base_id_) {
    return "the frame_id \"" + printable(frame) + "\" is unknown: expected no frame_id, " + base_id_ + " or " +
           operator_id_;
  }
  if (!command.force.allFinite() || !command.torque.allFinite()) return "it contains a number that is not finite";
  const View& view = of_operator ? operator_ : base_;
  const double sign = negate ? -1 : 1;
  return Wish{.force = view.base_force(sign * command.force), .torque = view.base_torque(sign * command.torque)};
}

RosJoy joy_of(const DeviceState& state, const std::optional<HandleDescription>& handle, RosHeader header) {
  RosJoy joy{.header = std::move(header), .axes = {}, .buttons = {}};
  const std::size_t count =
      std::max(handle ? handle->buttons.size() : 0, static_cast<std::size_t>(std::bit_width(state.buttons)));
  for (std::size_t i = 0; i < count; ++i) joy.buttons.push_back((state.buttons >> i & 1U) != 0 ? 1 : 0);
  if (state.grip) {
    const double open = handle && handle->gripper_open && *handle->gripper_open > 0 ? *handle->gripper_open : 1;
    joy.axes.push_back(static_cast<float>(state.grip->opening / open));
  }
  return joy;
}

std::optional<RosJointState> joints_of(const DeviceState& state, const std::optional<HandleDescription>& handle,
                                       RosHeader header) {
  if (!state.joints || !handle || handle->joints.size() != state.joints->count) return {};
  const auto count = static_cast<std::ptrdiff_t>(state.joints->count);
  return RosJointState{.header = std::move(header),
                       .name = handle->joints,
                       .position = {state.joints->angle.begin(), state.joints->angle.begin() + count},
                       .velocity = {state.joints->velocity.begin(), state.joints->velocity.begin() + count}};
}

}  // namespace tendon::bridge
