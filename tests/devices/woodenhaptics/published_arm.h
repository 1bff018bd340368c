// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/base/motion.h"

/// Parameters in their published order, with kinematics independent of devices/woodenhaptics: rotations of links
/// instead of sums of sines, and circle intersection instead of the law of cosines.
namespace tendon::published_arm {

/// The values of a row are: variant; 3 capstans, 3 lengths, 3 bodies; origin, radius; 3 torque constants; full scale; 6 counts per turn; force,
/// stiffness, damping; masses, centers of mass, g; 6 calibration counts; 3 of "motor and body aligned".
using Row = std::array<double, 41>;

inline constexpr std::array<std::pair<std::string_view, Row>, 5> kRows = {{
    {"woodenhaptics_v2019",
     {0,     0.010,  0.010,  0.010, 0.080, 0.205, 0.245, 0.160, 0.120, 0.120, 0.220, 0.000, 0.080, 0.100,
      0.321, 0.0603, 0.0603, 3.0,   2000,  2000,  2000,  0,     0,     0,     5.0,   1000,  8.0,   0.170,
      0.110, 0.051,  0.091,  0,     0,     0,     6000,  0,     0,     0,     0,     0,     0}},
    {"woodenhaptics_v2015",
     {0,      0.010,  0.010,  0.010, 0.080, 0.205, 0.245, 0.160, 0.120, 0.120, 0.220, 0.000, 0.080, 0.100,
      0.0259, 0.0259, 0.0259, 6.0,   2000,  2000,  2000,  0,     0,     0,     5.0,   1000,  8.0,   0.170,
      0.110,  0.051,  0.091,  0,     0,     0,     6000,  0,     0,     0,     0,     0,     0}},
    {"polhem_v1", {2,      0.010,  0.010,  0.010, 0.058, 0.174, 0.133, 0.180, 0.100, 0.100, 0.140, 0.000, 0.100, 0.100,
                   0.0538, 0.0538, 0.0538, 3.0,   2000,  2000,  2000,  1024,  1024,  1024,  5.0,   800,   8.0,   0.080,
                   0.080,  0.040,  0.070,  0,     0,     0,     -5000, 0,     0,     0,     1,     1,     1}},
    {"aluhaptics_v2",
     {1,      0.0138, 0.0098, 0.0098, 0.111, 0.140, 0.111, 0.116, 0.076, 0.076, 0.140, 0.000, 0.000, 0.100,
      0.0259, 0.0259, 0.0259, 3.0,    2000,  2000,  2000,  0,     0,     0,     5.0,   1000,  8.0,   0.170,
      0.110,  0.051,  0.091,  0,      0,     0,     0,     0,     0,     0,     0,     0,     0}},
    {"vintage", {1,      0.013,  0.010,  0.010, 0.056, 0.138, 0.112, 0.117, 0.077, 0.077, 0.140, 0.000, 0.000, 0.100,
                 0.0163, 0.0163, 0.0163, 3.0,   4000,  4000,  4000,  0,     0,     0,     5.0,   800,   8.0,   0.170,
                 0.110,  0.051,  0.091,  0,     0,     0,     0,     0,     0,     0,     0,     0,     0}},
}};

struct Arm {
  explicit Arm(std::string_view name) {
    for (const auto& [known, numbers] : kRows) {
      if (known == name) row = numbers;
    }
  }

  Vec3 three(std::size_t at) const { return {row[at], row[at + 1], row[at + 2]}; }
  Vec3 length() const { return three(4); }
  Vec3 origin() const { return three(10); }
  double radius() const { return row[13]; }
  double full_scale() const { return row[17]; }
  Vec3 calibration() const { return three(32); }
  Vec3 direction() const { return Vec3::Ones() - 2 * three(38); }

  Vec3 per_count() const {
    return (2 * std::numbers::pi * direction()).cwiseQuotient(three(18)).cwiseProduct(three(1)).cwiseQuotient(three(7));
  }
  Vec3 per_ampere() const { return direction().cwiseProduct(three(14)).cwiseProduct(three(7)).cwiseQuotient(three(1)); }

  Vec3 position_at(const Vec3& angles) const {
    const auto about = [](double angle, const Vec3& axis) { return Eigen::AngleAxisd(angle, axis); };
    const Vec3 up = about(angles[1], Vec3::UnitY()) * Vec3(0, 0, length()[1]);
    const Vec3 down = about(-angles[2], Vec3::UnitY()) * Vec3(0, 0, -length()[2]);
    return Vec3(0, 0, length()[0]) + about(angles[0], Vec3::UnitZ()) * Vec3(up + down) - origin();
  }

  /// Returns the upper one of the intersections of the circles around the shoulder and the tip.
  Vec3 angles_at(const Vec3& position) const {
    const Vec3 at = position + origin();
    const Eigen::Vector2d tip(std::hypot(at.x(), at.y()), at.z() - length()[0]);
    const double b = length()[1];
    const double c = length()[2];
    const double far = tip.norm();
    const double along = (far * far + b * b - c * c) / (2 * far);
    const Eigen::Vector2d unit = tip / far;
    const Eigen::Vector2d elbow =
        along * unit + std::sqrt(b * b - along * along) * Eigen::Vector2d(-unit.y(), unit.x());
    const Eigen::Vector2d rest = tip - elbow;
    return {std::atan2(at.y(), at.x()), std::atan2(elbow.x(), elbow.y()), std::atan2(rest.x(), -rest.y())};
  }

  /// Returns ∂position/∂angles by fourth-order central differences.
  Mat3 numeric_jacobian(const Vec3& angles) const {
    constexpr double kStep = 1e-3;
    Mat3 jacobian;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Vec3 step = kStep * Vec3::Unit(i);
      const Vec3 near = position_at(angles + step) - position_at(angles - step);
      const Vec3 far = position_at(angles + 2 * step) - position_at(angles - 2 * step);
      jacobian.col(i) = (8 * near - far) / (12 * kStep);
    }
    return jacobian;
  }

  Row row{};
};

}  // namespace tendon::published_arm
