// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// The fixed nodes of a piece of a body. If three of them are not on one line, the piece cannot move as a rigid body.
class Hold {
 public:
  void add(const Vec3& place) {
    if (!first_) {
      first_ = place;
    } else if (!second_) {
      if (place != *first_) second_ = place;
    } else {
      const Vec3 line = *second_ - *first_;
      fast_ = fast_ || line.cross(place - *first_).norm() > kOnLine * line.squaredNorm();
    }
  }
  bool fast() const noexcept { return fast_; }

 private:
  static constexpr double kOnLine = 1e-6;  // fraction of the distance between the first two nodes
  std::optional<Vec3> first_;
  std::optional<Vec3> second_;
  bool fast_ = false;
};

}  // namespace tendon::softbody
