// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "clients/softbody/touch/contact.h"

namespace tendon::softbody::testing {

/// −∂force/∂place by central differences. `felt` maps a place to a Feel.
template <class Felt>
Mat3 force_slope(const Vec3& place, double step, const Felt& felt) {
  Mat3 all;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 way = step * Vec3::Unit(axis);
    all.col(axis) = (felt(place - way).force - felt(place + way).force) / (2 * step);
  }
  return all;
}

struct ClosedWay {
  double work = 0;     ///< total work of the hand on the body
  double most = 0;     ///< largest intermediate value
  double turning = 0;  ///< sum of the absolute values for rotations
};
/// `handle` maps [0, 1] to poses, and `felt` a pose to a Feel. Each answer is at the middle of its step.
template <class Handle, class Felt>
ClosedWay closed_way(const Handle& handle, int steps, const Felt& felt) {
  ClosedWay sum;
  for (int i = 0; i < steps; ++i) {
    const Pose from = handle(static_cast<double>(i) / steps);
    const Pose to = handle((i + 1.0) / steps);
    const Feel feel = felt(handle((i + 0.5) / steps));
    const Eigen::AngleAxisd turned(Mat3(to.turn * from.turn.transpose()));
    const double by_turning = feel.torque ? feel.torque->torque.dot(turned.angle() * turned.axis()) : 0;
    sum.work -= feel.force.dot(to.position - from.position) + by_turning;
    sum.turning += std::abs(by_turning);
    sum.most = std::max(sum.most, std::abs(sum.work));
  }
  return sum;
}

}  // namespace tendon::softbody::testing
