// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "clients/bridge/view.h"
#include "protocol/messages.h"

namespace tendon::bridge {

// ROS 2 messages as plain structs, independent of DDS. SI units. Wrenches act **on the hand**. The axes follow REP
// 103 (x forward, y left, z up) in frame `NAME_base`, whose origin is that of the device.

struct RosTime {
  std::int32_t sec = 0;  ///< since 1970-01-01
  std::uint32_t nanosec = 0;
  bool operator==(const RosTime&) const = default;
};
struct RosHeader {
  RosTime stamp;
  std::string frame_id;
};
struct RosPose {  // geometry_msgs/PoseStamped
  RosHeader header;
  Vec3 position = Vec3::Zero();
  Quat orientation;
};
struct RosTwist {  // geometry_msgs/TwistStamped
  RosHeader header;
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
};
struct RosWrench {  // geometry_msgs/WrenchStamped
  RosHeader header;
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
};
struct RosJoy {  // sensor_msgs/Joy
  RosHeader header;
  std::vector<float> axes;
  std::vector<std::int32_t> buttons;
};
struct RosJointState {  // sensor_msgs/JointState, without efforts
  RosHeader header;
  std::vector<std::string> name;
  std::vector<double> position;
  std::vector<double> velocity;
};
struct RosDiagnosis {  // diagnostic_msgs/DiagnosticStatus
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };
  Level level = Level::kOk;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

struct RosOperatingState {  // crtk_msgs/OperatingState
  RosHeader header;
  std::string state;  ///< DISABLED, ENABLED or FAULT
  bool is_homed = false;
  bool is_busy = false;
};

/// A message from a program.
struct RosInput {
  enum class Topic : std::uint8_t { kWrenchCommand, kServoCf, kServoCp, kStateCommand };
  Topic topic = Topic::kWrenchCommand;
  std::uint64_t writer = 0;  ///< identifies the publisher in DDS
  std::string called;        ///< name of the publisher in messages
  RosWrench wrench{};        ///< of kWrenchCommand and kServoCf
  std::string text{};        ///< of kStateCommand
};
std::string_view topic_name(RosInput::Topic topic);  ///< "wrench_command"

RosTime ros_time(Duration since_1970);  ///< requires `since_1970` ≥ 0

/// Converts a device name for use in topics and frames: replaces all characters except ASCII letters, digits and "_"
/// by "_", and inserts "_" before a leading digit.
std::string ros_name(std::string_view device);

std::string printable(std::string_view text);  ///< at most 64 bytes, with "?" for bytes that are not printable ASCII

/// Transforms one device to the frames of ROS. Thread-safe, realtime-safe: no.
class RosView {
 public:
  /// `name`: see ros_name(). Without a rotation, the device frame is assumed to equal the operator frame.
  RosView(std::string_view name, const std::optional<Quat>& operator_from_device);

  const std::string& base_id() const noexcept { return base_id_; }          ///< "right_base"
  const std::string& operator_id() const noexcept { return operator_id_; }  ///< "right_operator"

  RosPose pose(const DeviceState& state, RosTime stamp) const;      ///< identity if the orientation is not measured
  RosTwist twist(const DeviceState& state, RosTime stamp) const;    ///< base axes; ω is 0 if it is not measured
  RosWrench wrench(const DeviceState& state, RosTime stamp) const;  ///< applied; torque about the handle's position

  struct Wish {
    Vec3 force = Vec3::Zero();  ///< N and N·m, acting on the hand, device base frame
    Vec3 torque = Vec3::Zero();
  };
  /// Converts a command, or returns the reason for rejecting it: `frame_id` must be "", NAME_base or NAME_operator (x
  /// right, y up, z to the user), and all numbers finite. With `negate`, the message contains the force on a robot or
  /// by the hand, and the hand receives the opposite force.
  std::variant<Wish, std::string> wish(const RosWrench& command, bool negate) const;

 private:
  View base_;
  View operator_;
  std::string base_id_;
  std::string operator_id_;
};

/// `buttons`: 1 while pressed, in the order of the handle description. `axes`: opening of the gripper if there is
/// one, from 0 closed to 1 open, or in rad if its range is unknown.
RosJoy joy_of(const DeviceState& state, const std::optional<HandleDescription>& handle, RosHeader header);

/// Returns nullopt if the device measures no joints or has no names for them.
std::optional<RosJointState> joints_of(const DeviceState& state, const std::optional<HandleDescription>& handle,
                                       RosHeader header);

}  // namespace tendon::bridge
