// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/LU>  // determinant()
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/motion.h"

namespace tendon {

/// Which way is up, for devices and for the programs that draw or compute with their positions.
///
/// The **operator frame** is what the person at the handle sees: x to the right, y up, z towards the user;
/// right-handed; metres. It is the frame of OpenXR and WebXR. Positions on the wire stay in the device base frame; a
/// device's `operator_from_device` turns them:
///
///     p_operator = R p_device        the same R for velocities, forces and torques

/// Reads the axes of a device in words, "right=x up=y user=z": which axis of the device base frame points to the
/// operator's right, which up, which towards the user, each with its sign ("right=-y up=z user=-x"). The words may be
/// in any order. Returns R. Throws std::invalid_argument with what was expected when a word is missing, unknown or
/// there twice, when two name the same axis, or when the three make a left-handed frame, which no rotation can reach.
Mat3 operator_from_device(std::string_view axes);

/// The words for R; empty when R does not turn axes into axes.
std::string axes_in_words(const Mat3& rotation);

/// The same rotation in the other form. `rotation` is orthonormal with determinant 1; `q` may have any length but 0.
Quat quaternion_of(const Mat3& rotation);
Mat3 matrix_of(const Quat& q);

/// The frame of a program or of an interface, as seen from the operator frame.
///
///     position, velocity:  v = per_metre M v_operator       v_operator = Mᵀ v / per_metre
///     force:               f = M f_operator                 f_operator = Mᵀ f
///     orientation:         R = M R_operator Mᵀ              R_operator = Mᵀ R M
///
/// M is orthonormal. In a left-handed frame its determinant is −1, and the three lines hold all the same: an
/// orientation is turned as a matrix and never by changing the signs of a quaternion. A torque is an axial vector: τ =
/// det(M) M τ_operator.
struct Frame {
  std::string_view name;    ///< lower case, for options: "ros"
  std::string_view axes;    ///< of the frame, for people: "x forward, y left, z up"
  std::string_view source;  ///< who says so
  Mat3 from_operator;       ///< M
  double per_metre = 1;     ///< 100 where lengths are in centimetres

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

/// All frames that are known: the operator's, VRPN's and OpenHaptics', CHAI3D's, the Inverse's, ROS's, Unity's,
/// Unreal's.
std::span<const Frame> frames();

/// Null when there is none of that name.
const Frame* find_frame(std::string_view name);

}  // namespace tendon
