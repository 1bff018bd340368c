// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/LU>  // determinant()
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/motion.h"

namespace tendon {

/// The coordinate frames that are used by devices and by programs that use their positions.
///
/// The **operator frame** is used for the person at the handle, as in OpenXR and WebXR. It is right-handed, in metres,
/// with x to the right, y up and z towards the user. Positions on the wire are in the device base frame:
///     p_operator = R p_device        the same R for velocities, forces and torques

/// Returns R for the axes of a device, such as "right=-y up=z user=-x": the axes of the device base frame that point to
/// the right of the operator, up, and towards the user, in any order. Throws std::invalid_argument with the expected
/// form if a word is missing, unknown or repeated, if two words name the same axis, or if the frame is left-handed.
Mat3 operator_from_device(std::string_view axes);

/// Returns R in this form, or an empty string if R does not map axes to axes.
std::string axes_in_words(const Mat3& rotation);

/// `rotation` must be orthonormal with determinant 1. The length of `q` can be any value except 0.
Quat quaternion_of(const Mat3& rotation);
Mat3 matrix_of(const Quat& q);

/// The frame of a program or an interface, relative to the operator frame.
///     position, velocity:  v = per_metre M v_operator       v_operator = Mᵀ v / per_metre
///     force:               f = M f_operator                 f_operator = Mᵀ f
///     orientation:         R = M R_operator Mᵀ              R_operator = Mᵀ R M
/// M is orthonormal. The equations can also be used for a left-handed frame, whose determinant is −1. Never convert an
/// orientation by changing signs of a quaternion. A torque is axial: τ = det(M) M τ_operator.
struct Frame {
  std::string_view name;    ///< lower case, for options, such as "ros"
  std::string_view axes;    ///< description, such as "x forward, y left, z up"
  std::string_view source;  ///< document that defines the frame
  Mat3 from_operator;       ///< M
  double per_metre = 1;     ///< 100 for centimetres, 1000 for millimetres

  bool is_right_handed() const { return from_operator.determinant() > 0; }

  Vec3 position(const Vec3& of_operator) const { return per_metre * (from_operator * of_operator); }
  Vec3 force(const Vec3& of_operator) const { return from_operator * of_operator; }
  Vec3 torque(const Vec3& of_operator) const { return from_operator.determinant() * (from_operator * of_operator); }
  Mat3 orientation(const Mat3& of_operator) const { return from_operator * of_operator * from_operator.transpose(); }

  Vec3 operator_position(const Vec3& here) const { return from_operator.transpose() * here / per_metre; }
  Vec3 operator_force(const Vec3& here) const { return from_operator.transpose() * here; }
  Vec3 operator_torque(const Vec3& here) const {
    return from_operator.determinant() * (from_operator.transpose() * here);
  }
  Mat3 operator_orientation(const Mat3& here) const { return from_operator.transpose() * here * from_operator; }
};

/// The known frames: operator, VRPN and OpenHaptics, CHAI3D, Inverse, ROS, RAS, Unity, Unreal.
std::span<const Frame> frames();

/// Returns null if no frame has this name.
const Frame* find_frame(std::string_view name);

}  // namespace tendon
