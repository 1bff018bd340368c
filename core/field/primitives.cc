// SPDX-License-Identifier: Apache-2.0
#include "core/field/primitives.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon::field {
namespace {

constexpr double kUnit = 1e-3;  ///< tolerance of the length of a normal

/// Returns v/‖v‖ and ‖v‖; the z axis for a zero vector.
SurfacePoint away_from(const Vec3& v) noexcept {
  const double length = v.norm();
  return {.distance = length, .gradient = length > 0 ? Vec3(v / length) : Vec3(Vec3::UnitZ())};
}

SurfacePoint distance(const Plane& plane, const Vec3& x) noexcept {
  return {.distance = plane.normal.dot(x - plane.at), .gradient = plane.normal};
}

SurfacePoint distance(const Sphere& sphere, const Vec3& x) noexcept {
  SurfacePoint point = away_from(x - sphere.centre);
  point.distance -= sphere.radius;
  return point;
}

SurfacePoint distance(const Capsule& capsule, const Vec3& x) noexcept {
  const Vec3 axis = capsule.to - capsule.from;
  const Vec3 way = x - capsule.from;
  const double squared = axis.squaredNorm();
  const double share = squared > 0 ? std::clamp(way.dot(axis) / squared, 0.0, 1.0) : 0.0;
  SurfacePoint point = away_from(way - share * axis);
  point.distance -= capsule.radius;
  return point;
}

SurfacePoint distance(const Box& box, const Vec3& x) noexcept {
  const Vec3 local = rotated(inverse(box.turn), x - box.centre);
  const Vec3 q = local.cwiseAbs() - box.half + Vec3::Constant(box.rounding);
  const Vec3 outside = q.cwiseMax(0.0);
  SurfacePoint point;
  if (outside.squaredNorm() > 0) {
    point = away_from(outside);
  } else {
    Eigen::Index nearest = 0;
    point.distance = q.maxCoeff(&nearest);
    point.gradient = Vec3::Unit(nearest);
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (local[i] < 0) point.gradient[i] = -point.gradient[i];
  }
  point.distance -= box.rounding;
  point.gradient = rotated(box.turn, point.gradient);
  return point;
}

void expect_valid(const Plane& plane) {
  expect_finite(plane.at, "plane.at");
  expect(std::abs(plane.normal.norm() - 1) <= kUnit, "plane.normal", plane.normal.norm(), "a vector of length 1");
}

void expect_valid(const Sphere& sphere) {
  expect_finite(sphere.centre, "sphere.centre");
  expect_above_zero(sphere.radius, "sphere.radius");
}

void expect_valid(const Capsule& capsule) {
  expect_finite(capsule.from, "capsule.from");
  expect_finite(capsule.to, "capsule.to");
  expect_above_zero(capsule.radius, "capsule.radius");
}

void expect_valid(const Box& box) {
  expect_finite(box.centre, "box.centre");
  for (Eigen::Index i = 0; i < 3; ++i) expect_above_zero(box.half[i], "box.half");
  expect(box.rounding >= 0 && box.rounding <= box.half.minCoeff(), "box.rounding", box.rounding,
         "0 m or more, and at most the least half side of " + shortest(box.half.minCoeff()) + " m");
  expect(is_rotation(box.turn), "box.turn.w", box.turn.w, "a quaternion of length 1");
}

}  // namespace

void expect_valid(const Primitive& primitive) {
  std::visit([](const auto& shape) { expect_valid(shape); }, primitive.shape);
}

SurfacePoint distance(const Primitive& primitive, const Vec3& x) noexcept {
  SurfacePoint point = std::visit([&](const auto& shape) { return distance(shape, x); }, primitive.shape);
  if (primitive.hollow) {
    point.distance = -point.distance;
    point.gradient = -point.gradient;
  }
  point.material = primitive.material;
  return point;
}

}  // namespace tendon::field
