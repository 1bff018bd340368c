// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/motion.h"

namespace tendon::field {

/// A virtual fixture: a spring from the hand x to the nearest point p of a point, a line or a plane. With d = ‖p − x‖:
///     U(d) = ½ K d² for d ≤ F_most/K, beyond F_most d − F_most²/(2K)       J
/// A line and a plane are endless, and a plane attracts from both sides. In the frame of the object.
struct Fixture {
  enum class Kind : std::uint8_t { kPoint, kLine, kPlane };

  Kind kind = Kind::kPoint;
  Vec3 at = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();                               ///< unit vector along the line or normal to the plane
  double stiffness = 0;                                         ///< K, N/m, > 0
  double most_force = std::numeric_limits<double>::infinity();  ///< F_most, N, > 0

  Vec3 nearest(const Vec3& x) const noexcept {
    if (kind == Kind::kPoint) return at;
    const double along = direction.dot(x - at);
    return kind == Kind::kLine ? Vec3(at + along * direction) : Vec3(x - along * direction);
  }
  double energy(double d) const noexcept {
    const double near = most_force / stiffness;
    return d <= near ? 0.5 * stiffness * d * d : most_force * (d - 0.5 * near);
  }
  double force(double d) const noexcept { return std::min(stiffness * d, most_force); }

  /// The largest d ≤ `most` with U(d) ≤ `energy`.
  double distance_of(double energy, double most) const noexcept {
    const double near = most_force / stiffness;
    const double at_near = 0.5 * most_force * near;
    const double d =
        energy <= at_near ? std::sqrt(2 * std::max(energy, 0.0) / stiffness) : 0.5 * near + energy / most_force;
    return std::min(d, most);
  }
};

}  // namespace tendon::field
