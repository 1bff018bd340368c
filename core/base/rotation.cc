// SPDX-License-Identifier: Apache-2.0
#include "core/base/rotation.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/base/portable_math.h"

namespace tendon {
namespace {

Vec3 axis_part(const Quat& q) noexcept { return {q.x, q.y, q.z}; }

Quat made_of(double w, const Vec3& v) noexcept { return {w, v.x(), v.y(), v.z()}; }

double squared_length(const Quat& q) noexcept { return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z; }

}  // namespace

Quat product(const Quat& a, const Quat& b) noexcept {
  const Vec3 v = axis_part(a);
  const Vec3 u = axis_part(b);
  return made_of(a.w * b.w - v.dot(u), a.w * u + b.w * v + v.cross(u));
}

Quat inverse(const Quat& q) noexcept { return {q.w, -q.x, -q.y, -q.z}; }

Quat unit(const Quat& q) noexcept {
  const double length = std::sqrt(squared_length(q));
  if (!(length > 0) || !std::isfinite(length)) return {};
  return {q.w / length, q.x / length, q.y / length, q.z / length};
}

bool is_rotation(const Quat& q) noexcept {
  constexpr double kTolerance = 1e-3;
  return std::abs(std::sqrt(squared_length(q)) - 1) <= kTolerance;
}

Quat rotation_by(const Vec3& vector) noexcept {
  const double angle = vector.norm();
  // sin(a/2)/a. Below this angle, the next term of the series is smaller than the rounding error.
  const double share = angle > 1e-8 ? portable::sin(angle / 2) / angle : 0.5;
  return made_of(portable::cos(angle / 2), vector * share);
}

Vec3 rotation_vector(const Quat& q) noexcept {
  const double sign = q.w < 0 ? -1.0 : 1.0;
  const Vec3 v = sign * axis_part(q);
  const double sine = v.norm();
  // a/sin(a/2). This uses the same threshold.
  const double share = sine > 1e-8 ? 2 * portable::atan2(sine, sign * q.w) / sine : 2.0;
  return v * share;
}

Vec3 turn_between(const Quat& from, const Quat& to) noexcept { return rotation_vector(product(to, inverse(from))); }

Vec3 rotated(const Quat& q, const Vec3& v) noexcept {
  const Vec3 axis = axis_part(q);
  const Vec3 across = 2 * axis.cross(v);
  return v + q.w * across + axis.cross(across);
}

bool is_within_reach(const Quat& rest, const Quat& q) noexcept {
  constexpr double kCosine = 0.25881904510252074;  // of half of 150°
  return std::abs(product(q, inverse(rest)).w) >= kCosine;
}

Vec3 spring_torque(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept {
  const Quat turn = product(q, inverse(rest));
  const Vec3 v = axis_part(turn);
  const Vec3 pull = stiffness * v;
  return -2 * (turn.w * pull + v.cross(pull));
}

double spring_energy(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept {
  const Vec3 v = axis_part(product(q, inverse(rest)));
  return 2 * v.dot(stiffness * v);
}

}  // namespace tendon
