// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// The signed distance of a point from a surface, and its first two derivatives by the place of the point.
struct Distance {
  double value = 0;               ///< φ, m; below 0 inside
  Vec3 gradient = Vec3::Zero();   ///< ∇φ, a unit vector away from the surface's inside
  Mat3 curvature = Mat3::Zero();  ///< ∇∇φ, 1/m
};

/// The shape of a rigid tool, around its own middle, as a signed distance: all points within `rounding` of a box, the
/// core. A core without size makes a sphere, one of a single length a capsule, and any other a box with round edges.
/// With q = |x| − core, taken for each axis, and w the part of q above 0:
///
///     φ = |w| − rounding outside the core,   max q − rounding inside it
///
/// φ is the exact distance everywhere outside the core. There it has one derivative everywhere, and a second one that
/// jumps where a flat side meets a round edge. Inside the core it lacks the first one halfway between two sides.
///
/// Without state. Thread-safe: yes. Realtime-safe: yes, once built.
class RigidShape {
 public:
  /// Lengths in m. Each throws std::invalid_argument that names the field.
  static RigidShape sphere(double radius);
  /// `half_length`: from the middle to the centre of each end, 0 or more; `axis`: a unit vector.
  static RigidShape capsule(double radius, double half_length, const Vec3& axis);
  /// `size`: of the whole box along its three axes; `edge`: the radius of its edges and corners, above 0 and at most
  /// half of the least size.
  static RigidShape box(const Vec3& size, double edge);

  /// At `x`, m, in the tool's frame.
  Distance distance(const Vec3& x) const;

  /// m, from the middle to the point of the surface that is farthest from it.
  double reach() const noexcept { return core_.norm() + rounding_; }

  /// m, from the middle to the point of the surface that is farthest along `direction`, a unit vector in the tool's
  /// frame.
  Vec3 farthest(const Vec3& direction) const;

 private:
  RigidShape(const Vec3& core, double rounding, const Mat3& turn) : core_(core), rounding_(rounding), turn_(turn) {}

  Vec3 core_;  ///< half of the core's size, m
  double rounding_;
  Mat3 turn_;  ///< the core's axes, as columns, in the tool's frame
};

}  // namespace tendon::softbody
