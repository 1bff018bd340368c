// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "protocol/frames.h"
#include "protocol/rotation.h"

namespace tendon::plug {

/// A device as another program sees it: its device base frame ⇄ the program's frame (core/base/frames.h).
///
///     p_program = per_metre M A p_base        A: HandleDescription::operator_from_device, M: Frame::from_operator
///     K_base    = (M A)ᵀ K_program (M A)      a stiffness, N/m; forces are turned, never scaled
///     R_program = M A R_handle Mᵀ             an orientation; R_handle turns the handle frame into the base frame
///
/// The handle frame has the operator's axes while the handle is in its middle: the stylus points along −z. So the
/// program's frame of the handle has the program's own axes there, and the identity means "not turned" everywhere.
///
/// Thread-safe, realtime-safe: yes.
class View {
 public:
  /// Without a rotation the device's frame is taken for the operator's.
  View(const Frame& frame, const std::optional<Quat>& operator_from_device)
      : frame_(&frame),
        operator_from_base_(operator_from_device ? matrix_of(*operator_from_device) : Mat3(Mat3::Identity())) {}

  Vec3 position(const Vec3& base) const { return frame_->position(operator_from_base_ * base); }  ///< velocities too
  Vec3 force(const Vec3& base) const { return frame_->force(operator_from_base_ * base); }
  Vec3 torque(const Vec3& base) const {
    return frame_->torque(operator_from_base_ * base);
  }  ///< angular velocities too
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

}  // namespace tendon::plug
