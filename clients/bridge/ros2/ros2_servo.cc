// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_servo.h"

namespace tendon::bridge {

RosServo::Output RosServo::take(const RosPose& pose, const RosTwist& twist, bool held) {
  const RosHeader header{pose.header.stamp, frame_id_};
  if (!held) {
    const bool let_go = hand_.has_value();
    hand_.reset();
    if (!let_go || kind_ == Kind::kPose) return {};
    return {.twist = RosTwist{.header = header}};
  }
  const Mat3 turn = matrix_of(pose.orientation);
  if (!hand_) {
    hand_ = Hand{pose.position, turn};
    start_ = target_;
    start_turn_ = target_turn_;
  }
  if (kind_ == Kind::kTwist) {
    return {.twist = RosTwist{.header = header, .linear = scale_ * twist.linear, .angular = twist.angular}};
  }
  target_ = start_ + scale_ * (pose.position - hand_->position);
  target_turn_ = turn * hand_->turn.transpose() * start_turn_;
  return {.pose = RosPose{.header = header, .position = target_, .orientation = quaternion_of(target_turn_)}};
}

}  // namespace tendon::bridge
