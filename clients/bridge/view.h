// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "protocol/frames.h"
#include "protocol/rotation.h"

namespace tendon::bridge {

/// Transforms between the device base frame and the frame of a program (core/base/frames.h):
///
///     p_program = per_metre M A p_base        A: HandleDescription::operator_from_device, M: Frame::from_operator
///     K_base    = (M A)ᵀ K_program (M A)      stiffness, N/m; forces are rotated but not scaled
///     R_program = M A R_handle Mᵀ             orientation; R_handle rotates the handle frame to the base frame
///
/// With the handle in its center, the axes of the handle frame are those of the operator, with the stylus along −z.
/// The identity therefore means "not rotated" in both frames.
///
/// Thread-safe, realtime-safe: yes.
class View {
 public:
  /// Without a rotation, the device frame is assumed to equal the operator frame.
  View(const Frame& frame, const std::optional<Quat>& operator_from_device)
      : frame_(&frame),
        operator_from_base_(operator_from_device ? matrix_of(*operator_from_device) : Mat3(Mat3::Identity())) {}

  Vec3 position(const Vec3& base) const { return frame_->position(operator_from_base_ * base); }  ///< or a velocity
  Vec3 force(const Vec3& base) const { return frame_->force(operator_from_base_ * base); }
  Vec3 torque(const Vec3& base) const {
    return frame_->torque(operator_from_base_ * base);
  }  ///< or an angular velocity
  Mat3 orientation(const Quat& handle) const { return frame_->orientation(operator_from_base_ * matrix_of(handle)); }

  Vec3 base_position(const Vec3& here) const { return back(frame_->operator_position(here)); }
  Vec3 base_force(const Vec3& here) const { return back(frame_->operator_force(here)); }
  Vec3 base_torque(const Vec3& here) const { return back(frame_->operator_torque(here)); }
  Mat3 base_stiffness(const Mat3& here) const {
    const Mat3 turn = frame_->from_operator * operator_from_base_;
    return turn.transpose() * here * turn;
  }

 private:
  Vec3 back(const Vec3& of_operator) const { return operator_from_base_.transpose() * of_operator; }

  const Frame* frame_;
  Mat3 operator_from_base_;
};

}  // namespace tendon::bridge
