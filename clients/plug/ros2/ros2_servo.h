// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "clients/plug/ros2/ros2_messages.h"

namespace tendon::plug {

/// The hand's motion for a robot arm, only while a button (the clutch) is held: the inputs of MoveIt Servo.
///
///     twist:  v = scale · v_hand,  ω = ω_hand;                     one of zero when the clutch is let go
///     pose:   p = p₀ + scale · (p_hand − p_hand,₀),  R = R_hand R_hand,₀ᵀ R₀
///
/// with ₀ at the press. p₀ and R₀ are where the last hold has ended, at first the origin, not turned: so the pose is
/// seen from a frame that stands where the tool was at the first press, with REP 103's axes as the operator sees them.
/// Whoever has the robot tells tf where that frame is. A session that is lost ends the hold; the hand is taken anew
/// afterwards, so that nothing jumps.
///
/// Thread-safe, realtime-safe: no.
class RosServo {
 public:
  enum class Kind : std::uint8_t { kTwist, kPose };

  /// `frame_id` is for the headers.
  RosServo(Kind kind, double scale, std::string frame_id)
      : kind_(kind), scale_(scale), frame_id_(std::move(frame_id)) {}

  struct Output {
    std::optional<RosTwist> twist{};
    std::optional<RosPose> pose{};
  };
  /// `pose` and `twist` are of one state, in the device's base frame.
  Output take(const RosPose& pose, const RosTwist& twist, bool held);
  /// There is no session.
  void lose() { hand_.reset(); }

 private:
  struct Hand {
    Vec3 position;
    Mat3 turn;
  };
  Kind kind_;
  double scale_;
  std::string frame_id_;
  std::optional<Hand> hand_;  ///< at the press; empty: not held
  Vec3 start_ = Vec3::Zero();
  Mat3 start_turn_ = Mat3::Identity();
  Vec3 target_ = Vec3::Zero();
  Mat3 target_turn_ = Mat3::Identity();
};

}  // namespace tendon::plug
