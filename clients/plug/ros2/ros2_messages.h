// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "clients/plug/view.h"
#include "protocol/messages.h"

namespace tendon::plug {

// ROS 2's messages as values, and what of a device is in them. No DDS here. SI units; a wrench is what the device exerts
// **on the hand**. Axes are REP 103's, x forward, y left, z up, and those of `NAME_base`, whose origin is the device's.

struct RosTime {
  std::int32_t sec = 0;  ///< since 1970
  std::uint32_t nanosec = 0;
  bool operator==(const RosTime&) const = default;
};
struct RosHeader {
  RosTime stamp;
  std::string frame_id;
};
/// geometry_msgs/PoseStamped
struct RosPose {
  RosHeader header;
  Vec3 position = Vec3::Zero();
  Quat orientation;
};
/// geometry_msgs/TwistStamped
struct RosTwist {
  RosHeader header;
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
};
/// geometry_msgs/WrenchStamped
struct RosWrench {
  RosHeader header;
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
};
/// sensor_msgs/Joy
struct RosJoy {
  RosHeader header;
  std::vector<float> axes;
  std::vector<std::int32_t> buttons;
};
/// sensor_msgs/JointState, without efforts
struct RosJointState {
  RosHeader header;
  std::vector<std::string> name;
  std::vector<double> position;
  std::vector<double> velocity;
};
/// diagnostic_msgs/DiagnosticStatus
struct RosDiagnosis {
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };
  Level level = Level::kOk;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

/// `since_1970` is not before that.
RosTime ros_time(Duration since_1970);

/// A device's name as a part of topics and frames: what is no letter of ASCII, digit or "_" becomes "_", and a digit
/// at the beginning gets a "_" before it.
std::string ros_name(std::string_view device);

/// `text` for people: at most 64 bytes of it, and "?" for all that is not printable ASCII.
std::string printable(std::string_view text);

/// One device in ROS's frames.
///
/// Thread-safe, realtime-safe: no.
class RosView {
 public:
  /// `name`: see ros_name(). Without a rotation the device's frame is taken for the operator's.
  RosView(std::string_view name, const std::optional<Quat>& operator_from_device);

  const std::string& base_id() const noexcept { return base_id_; }          ///< "right_base"
  const std::string& operator_id() const noexcept { return operator_id_; }  ///< "right_operator"

  /// The orientation is the identity when the device does not measure it: the handle is not turned.
  RosPose pose(const DeviceState& state, RosTime stamp) const;
  /// In axes of the base; the angular velocity is 0 when it is not measured.
  RosTwist twist(const DeviceState& state, RosTime stamp) const;
  /// What the device really gives out; the torque about the handle's position.
  RosWrench wrench(const DeviceState& state, RosTime stamp) const;

  /// What a `wrench_command` asks for.
  struct Wish {
    Vec3 force = Vec3::Zero();  ///< N and N·m, on the hand, device base frame
    Vec3 torque = Vec3::Zero();
  };
  /// The wish, or why there is none: its `frame_id` is none of "", NAME_base and NAME_operator (the operator frame: x
  /// right, y up, z to the user), or a number is not finite. `negate`: the message says what a robot feels or what the
  /// hand exerts, so that the hand gets its opposite.
  std::variant<Wish, std::string> wish(const RosWrench& command, bool negate) const;

 private:
  View base_;
  View operator_;
  std::string base_id_;
  std::string operator_id_;
};

/// `buttons`: 1 while held, in the order of the handle's names. `axes`: with a gripper its opening, 0 closed … 1 open;
/// rad where the handle does not say how far it opens.
RosJoy joy_of(const DeviceState& state, const std::optional<HandleDescription>& handle, RosHeader header);

/// Empty when the device tells no joints, or has not named them.
std::optional<RosJointState> joints_of(const DeviceState& state, const std::optional<HandleDescription>& handle,
                                       RosHeader header);

}  // namespace tendon::plug
