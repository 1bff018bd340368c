// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/kinematics.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace tendon::woodenhaptics {
namespace {

constexpr double kLeastElbow = 0.1;     // sin e
constexpr double kLeastRadius = 0.020;  // m, ρ
constexpr double kMilli = 1e-3;

double radius_of(const Model& model, const Vec3& angles) {
  return model.joints[1].length * std::sin(angles[1]) + model.joints[2].length * std::sin(angles[2]);
}

Vec3 origin_of(const Model& model) { return {model.origin[0], model.origin[1], model.origin[2]}; }

/// N·m at the body per A.
Vec3 torques_per_ampere(const Model& model) {
  Vec3 torques;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    torques[static_cast<Eigen::Index>(i)] = joint.direction * joint.torque_constant * joint.body / joint.capstan;
  }
  return torques;
}

}  // namespace

Vec3 angles_at(const Model& model, const Counts& counts) noexcept {
  Vec3 angles;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Joint& joint = model.joints[i];
    angles[static_cast<Eigen::Index>(i)] =
        joint.direction * 2 * std::numbers::pi * counts[i] / joint.counts_per_turn * joint.capstan / joint.body;
  }
  return angles;
}

Pose pose_with(const Model& model, const Vec3& angles) noexcept {
  const double upper = model.joints[1].length;
  const double lower = model.joints[2].length;
  const Vec3 outwards(std::cos(angles[0]), std::sin(angles[0]), 0);
  const Vec3 sideways(-outwards.y(), outwards.x(), 0);
  const double radius = radius_of(model, angles);
  const double height = model.joints[0].length + upper * std::cos(angles[1]) - lower * std::cos(angles[2]);
  Pose pose;
  pose.angles = angles;
  pose.position = radius * outwards + height * Vec3::UnitZ() - origin_of(model);
  pose.jacobian.col(0) = radius * sideways;
  pose.jacobian.col(1) = upper * (std::cos(angles[1]) * outwards - std::sin(angles[1]) * Vec3::UnitZ());
  pose.jacobian.col(2) = lower * (std::cos(angles[2]) * outwards + std::sin(angles[2]) * Vec3::UnitZ());
  return pose;
}

std::optional<Pose> pose_at(const Model& model, const Vec3& position) noexcept {
  const Vec3 at = position + origin_of(model);
  const double upper = model.joints[1].length;
  const double lower = model.joints[2].length;
  const double radius = std::hypot(at.x(), at.y());
  const double height = at.z() - model.joints[0].length;
  const double bend =
      (upper * upper + lower * lower - radius * radius - height * height) / (2 * upper * lower);  // cos e
  if (!(radius > 0) || !(std::abs(bend) < 1)) return std::nullopt;                                // also for NaN
  const double elbow = std::acos(bend);
  const double b = std::atan2(radius, height) - std::atan2(lower * std::sin(elbow), upper - lower * bend);
  Pose pose = pose_with(model, {std::atan2(at.y(), at.x()), b, elbow - b});
  pose.position = position;
  return pose;
}

double force_share(const Model& model, const Pose& pose) noexcept {
  const double elbow = std::sin(pose.angles[1] + pose.angles[2]);
  const double radius = radius_of(model, pose.angles);
  const double share = std::min((elbow - kLeastElbow) / kLeastElbow, (radius - kLeastRadius) / kLeastRadius);
  return std::clamp(share, 0.0, 1.0);
}

Currents currents_for(const Model& model, const Pose& pose, const Vec3& force, double most) noexcept {
  const Vec3 torque = pose.jacobian.transpose() * (force_share(model, pose) * force);
  Vec3 currents = torque.cwiseQuotient(torques_per_ampere(model)) / kMilli;
  if (!currents.allFinite()) return {};
  if (const double largest = currents.cwiseAbs().maxCoeff(); largest > most) currents *= most / largest;
  const auto whole = [&currents](Eigen::Index i) { return static_cast<std::int16_t>(currents[i]); };
  return {whole(0), whole(1), whole(2)};
}

std::optional<Vec3> force_of(const Model& model, const Pose& pose, const Currents& currents) noexcept {
  if (force_share(model, pose) <= 0) return std::nullopt;
  const Vec3 amperes = kMilli * Vec3(currents[0], currents[1], currents[2]);
  const Vec3 torque = amperes.cwiseProduct(torques_per_ampere(model));
  return pose.jacobian.transpose().partialPivLu().solve(torque);
}

}  // namespace tendon::woodenhaptics
