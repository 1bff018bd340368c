// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "clients/bridge/ros2/ros2_messages.h"

namespace tendon::bridge {

/// Input of MoveIt Servo from the motion of the hand while a button (the clutch) is pressed:
///
///     twist:  v = scale · v_hand,  ω = ω_hand;                     one zero message after the clutch is released
///     pose:   p = p₀ + scale · (p_hand − p_hand,₀),  R = R_hand R_hand,₀ᵀ R₀
///
/// where ₀ denotes the time of the press. p₀ and R₀ are the pose at the end of the previous press, initially zero and
/// identity. The pose is therefore relative to a frame at the pose of the tool at the first press, with the axes of REP
/// 103 as seen by the operator; the user must publish this frame to tf. If the session is lost, the press ends and the
/// hand pose is read again afterwards to avoid jumps.
///
/// Thread-safe, realtime-safe: no.
class RosServo {
 public:
  enum class Kind : std::uint8_t { kTwist, kPose };

  RosServo(Kind kind, double scale, std::string frame_id)
      : kind_(kind), scale_(scale), frame_id_(std::move(frame_id)) {}

  struct Output {
    std::optional<RosTwist> twist{};
    std::optional<RosPose> pose{};
  };
  /// `pose` and `twist` must be of the same state, in the base frame of the device.
  Output take(const RosPose& pose, const RosTwist& twist, bool held);
  void lose() { hand_.reset(); }  ///< must be called while there is no session

 private:
  struct Hand {
    Vec3 position;
    Mat3 turn;
  };
  Kind kind_;
  double scale_;
  std::string frame_id_;
  std::optional<Hand> hand_;  ///< pose of the hand when the button was pressed; empty if it is not pressed
  Vec3 start_ = Vec3::Zero();
  Mat3 start_turn_ = Mat3::Identity();
  Vec3 target_ = Vec3::Zero();
  Mat3 target_turn_ = Mat3::Identity();
};

}  // namespace tendon::bridge
