// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "core/base/motion.h"

/// The half-angle form of Stamper's thesis and the Jacobian of libnifalcon with its wrong z column. This code is
/// independent of devices/falcon/kinematics.cc.
namespace tendon::published {

struct Leg {
  double theta1;
  double theta2;
  double theta3;
};

inline constexpr double kA = .060, kB = .1025, kC = .01443, kD = .01125, kE = .01125, kF = -.025, kR = .0400,
                        kS = -.02309;
inline constexpr std::array<double, 3> kAzimuth = {105 * std::numbers::pi / 180, -15 * std::numbers::pi / 180,
                                                   -135 * std::numbers::pi / 180};

inline Leg leg_at(const Vec3& p, std::size_t leg) {
  const double cosine = std::cos(kAzimuth[leg]);
  const double sine = std::sin(kAzimuth[leg]);
  const double u = cosine * p.x() + sine * p.y() - kR;
  const double v = -sine * p.x() + cosine * p.y() - kS;
  const double w = p.z();
  Leg angles{};
  angles.theta3 = std::acos((v + kF) / kB);
  const double s3 = std::sin(angles.theta3);
  const double base = w * w + u * u + 2 * kC * u + kA * kA + kC * kC - kD * kD - kE * kE - kB * kB * s3 * s3 -
                      2 * kB * kE * s3 - 2 * kB * kD * s3 - 2 * kD * kE;
  const double l0 = base - 2 * kA * u - 2 * kA * kC;
  const double l1 = -4 * kA * w;
  const double l2 = base + 2 * kA * u + 2 * kA * kC;
  angles.theta1 = 2 * std::atan((-l1 - std::sqrt(l1 * l1 - 4 * l0 * l2)) / (2 * l2));
  angles.theta2 = std::atan2(w - kA * std::sin(angles.theta1), u + kC - kA * std::cos(angles.theta1));
  return angles;
}

inline Vec3 angles_at(const Vec3& p) { return {leg_at(p, 0).theta1, leg_at(p, 1).theta1, leg_at(p, 2).theta1}; }

/// ∂θ₁/∂z of a leg in libnifalcon, which uses sin² θ₂ in place of sin θ₃ sin θ₂.
inline double wrong_z_column(const Vec3& p, std::size_t leg) {
  const Leg angles = leg_at(p, leg);
  return std::pow(std::sin(angles.theta2), 2) /
         (kA * std::sin(angles.theta3) * std::sin(angles.theta2 - angles.theta1));
}

/// Returns ∂angles/∂position of `angles_at` by fourth-order central differences.
template <class AnglesAt>
Mat3 numeric_jacobian(const AnglesAt& angles_at, const Vec3& p) {
  constexpr double kStep = 1e-5;
  Mat3 jacobian;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep * Vec3::Unit(axis);
    const Vec3 near = angles_at(p + step) - angles_at(p - step);
    const Vec3 far = angles_at(p + 2 * step) - angles_at(p - 2 * step);
    jacobian.col(axis) = (8 * near - far) / (12 * kStep);
  }
  return jacobian;
}

/// rad at count 0 and rad per count.
inline constexpr double kAtZero = 35 * std::numbers::pi / 180;
inline constexpr double kPerCount =
    (0.01425 * std::numbers::pi / 1280) / (std::numbers::pi * 0.110 / 360) * std::numbers::pi / 180;

}  // namespace tendon::published
