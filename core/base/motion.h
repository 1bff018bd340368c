// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "core/base/time.h"

namespace tendon {

/// All vectors use the device base frame and SI units: m, m/s, N.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// A rotation as a unit quaternion in Hamilton's convention: w + x i + y j + z k. q and −q are the same rotation.
struct Quat {
  double w = 1;
  double x = 0;
  double y = 0;
  double z = 0;

  bool operator==(const Quat&) const = default;
};

struct Turning {
  Quat orientation;                      ///< rotates the handle frame into the base frame
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, base frame axes, an estimate

  bool operator==(const Turning&) const = default;
};

struct Grip {
  double opening = 0;   ///< rad; 0 = closed
  double velocity = 0;  ///< rad/s, an estimate

  bool operator==(const Grip&) const = default;
};

struct Joints {
  static constexpr std::size_t kMost = 8;
  std::size_t count = 0;                 ///< at most kMost; the remaining elements are 0
  std::array<double, kMost> angle{};     ///< rad
  std::array<double, kMost> velocity{};  ///< rad/s, an estimate

  static Joints three(const Vec3& angles, const Vec3& velocities) noexcept {
    return {.count = 3,
            .angle = {angles[0], angles[1], angles[2]},
            .velocity = {velocities[0], velocities[1], velocities[2]}};
  }
  bool operator==(const Joints&) const = default;
};

/// Force, torque and grip force of the motors on the hand.
struct Effort {
  Vec3 force = Vec3::Zero();   ///< N, base frame axes
  Vec3 torque = Vec3::Zero();  ///< N·m, base frame axes, about the position of the handle
  double grip = 0;             ///< N; opens the fingers if positive

  bool operator==(const Effort&) const = default;
};

/// The measured motion of the hand.
struct Motion {
  LocalTime at{};                ///< sample time
  Vec3 position = Vec3::Zero();  ///< m
  Vec3 velocity = Vec3::Zero();  ///< m/s, an estimate (see VelocityEstimator)
};

}  // namespace tendon
