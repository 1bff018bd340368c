// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/kinematics.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/base/arithmetic.h"

namespace tendon::falcon {
namespace {

// m. The letters are from Stamper, the numbers from FalconGeometry.h.
constexpr double kThigh = 0.060;          // a
constexpr double kShin = 0.1025;          // b
constexpr double kGripOut = 0.01443;      // c
constexpr double kOffsets = 2 * 0.01125;  // d + e
constexpr double kGripAside = -0.025;     // f
constexpr double kBaseOut = 0.0400;       // r
constexpr double kBaseAside = -0.02309;   // s

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAtZero = 35 * kDegree;
constexpr double kPerCount = 2 * std::numbers::pi * (14.25 / 110.0) / 1280;

constexpr double kTorquePerCount = -1e-4;  ///< N·m at the joint, with the sign used by the firmware

/// Rows: unit vectors along U, V, W in the device frame.
Mat3 frame_of_leg(double azimuth) {
  Mat3 frame;
  frame << std::cos(azimuth), std::sin(azimuth), 0,  //
      -std::sin(azimuth), std::cos(azimuth), 0,      //
      0, 0, 1;
  return frame;
}

const std::array<Mat3, 3> kLegs = {frame_of_leg((90 + 15) * kDegree), frame_of_leg((-30 + 15) * kDegree),
                                   frame_of_leg((-150 + 15) * kDegree)};

constexpr int kMostSteps = 25;
constexpr int kMostHalvings = 12;
constexpr double kLongestStep = 0.015;  // m; if a step is longer, the linear model is not accurate
constexpr double kClose = 1e-12;        // m; the last step

}  // namespace

Vec3 angles_at(const Counts& encoders) noexcept {
  return Vec3(encoders[0], encoders[1], encoders[2]) * kPerCount + Vec3::Constant(kAtZero);
}

std::optional<Pose> pose_at(const Vec3& position) noexcept {
  Pose pose;
  pose.position = position;
  for (std::size_t leg = 0; leg < kLegs.size(); ++leg) {
    const Vec3 at = kLegs[leg] * position;
    const double cos3 = (at.y() - kBaseAside + kGripAside) / kShin;
    const double sin3 = std::sqrt(1 - cos3 * cos3);  // θ₃ is in (0, π)
    const double reach = kOffsets + kShin * sin3;
    const double u = at.x() - kBaseOut + kGripOut;
    const double w = at.z();
    const double square = u * u + w * w;
    const double bend = (square + kThigh * kThigh - reach * reach) / (2 * kThigh * std::sqrt(square));
    const double theta1 = std::atan2(w, u) - std::acos(bend);
    // The direction from the knee to the grip, at the distance `reach`.
    const double cos2 = (u - kThigh * std::cos(theta1)) / reach;
    const double sin2 = (w - kThigh * std::sin(theta1)) / reach;
    const double lever = kThigh * sin3 * (sin2 * std::cos(theta1) - cos2 * std::sin(theta1));
    const auto row = static_cast<Eigen::Index>(leg);
    pose.angles[row] = theta1;
    pose.jacobian.row(row) = Vec3(sin3 * cos2, cos3, sin3 * sin2).transpose() * kLegs[leg] / lever;
  }
  if (!pose.angles.allFinite() || !pose.jacobian.allFinite()) return std::nullopt;
  return pose;
}

std::optional<Pose> pose_with(const Vec3& angles, const Vec3& start) noexcept {
  std::optional<Pose> pose = pose_at(start);
  for (int i = 0; i < kMostSteps && pose; ++i) {
    Vec3 step = pose->jacobian.partialPivLu().solve(angles - pose->angles);
    const double length = step.norm();
    if (!std::isfinite(length)) return std::nullopt;
    if (length > kLongestStep) step *= kLongestStep / length;
    const Vec3 from = pose->position;
    pose = pose_at(from + step);
    if (length < kClose) return pose;
    for (int halvings = 0; !pose && halvings < kMostHalvings; ++halvings) {
      step /= 2;
      pose = pose_at(from + step);
    }
  }
  return std::nullopt;
}

Counts counts_for(const Pose& pose, const Vec3& force) noexcept {
  Vec3 counts = pose.jacobian.transpose().partialPivLu().solve(force) / kTorquePerCount;
  if (!counts.allFinite()) return {};
  if (const double largest = counts.cwiseAbs().maxCoeff(); largest > kMostCounts) counts *= kMostCounts / largest;
  const auto whole = [&counts](Eigen::Index leg) { return static_cast<std::int16_t>(counts[leg]); };
  return {whole(0), whole(1), whole(2)};
}

Vec3 force_of(const Pose& pose, const Counts& counts) noexcept {
  return pose.jacobian.transpose() * (Vec3(counts[0], counts[1], counts[2]) * kTorquePerCount);
}

}  // namespace tendon::falcon
