// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/rigid_shape.h"

#include <Eigen/Geometry>
#include <cmath>

#include "protocol/expect.h"

namespace tendon::softbody {

RigidShape RigidShape::sphere(double radius) {
  expect_above_zero(radius, "radius");
  return {Vec3::Zero(), radius, Mat3::Identity()};
}

RigidShape RigidShape::capsule(double radius, double half_length, const Vec3& axis) {
  expect_above_zero(radius, "radius");
  expect_not_negative(half_length, "half_length");
  expect(std::abs(axis.norm() - 1) < 1e-9, "norm of axis", axis.norm(), "1");
  return {Vec3(0, 0, half_length), radius, Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix()};
}

RigidShape RigidShape::box(const Vec3& size, double edge) {
  for (const double length : size) expect_above_zero(length, "size");
  expect_above_zero(edge, "edge");
  expect(edge <= size.minCoeff() / 2, "edge", edge, "at most half of the least size");
  return {size / 2 - Vec3::Constant(edge), edge, Mat3::Identity()};
}

Distance RigidShape::distance(const Vec3& x) const {
  const Vec3 at = turn_.transpose() * x;
  const Vec3 sign = at.unaryExpr([](double value) { return std::copysign(1.0, value); });
  const Vec3 beyond = at.cwiseAbs() - core_;
  const Vec3 out = beyond.cwiseMax(0.0);
  const double away = out.norm();
  Distance found;
  if (away > 1e-9 * rounding_) {
    const Vec3 normal = sign.cwiseProduct(out) / away;
    const Vec3 round = (beyond.array() > 0).cast<double>();
    found.value = away - rounding_;
    found.gradient = turn_ * normal;
    const Mat3 across = Mat3(round.asDiagonal()) - normal * normal.transpose();
    found.curvature = turn_ * across * turn_.transpose() / away;
  } else {
    Eigen::Index side = 0;
    found.value = beyond.maxCoeff(&side) - rounding_;
    found.gradient = sign[side] * turn_.col(side);
  }
  return found;
}

Vec3 RigidShape::farthest(const Vec3& direction) const {
  Vec3 point = rounding_ * direction;
  for (int i = 0; i < 3; ++i) {
    const double along = turn_.col(i).dot(direction);
    if (std::abs(along) > 1e-9) point += std::copysign(core_[i], along) * turn_.col(i);
  }
  return point;
}

}  // namespace tendon::softbody
