// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/pose_map.h"

#include <cmath>

#include "core/base/expect.h"
#include "core/base/frames.h"
#include "core/base/rotation.h"

namespace tendon {

PoseMap::PoseMap(const Config& config)
    : position_scale_(config.position_scale),
      force_scale_(config.force_scale),
      rotation_(matrix_of(unit(config.rotation))),
      axes_(config.axes[0] ? 1 : 0, config.axes[1] ? 1 : 0, config.axes[2] ? 1 : 0) {
  const auto scale = [](double value, const char* field) {
    expect(value >= 0.01 && value <= 100, field, value, "0.01 to 100");
  };
  scale(config.position_scale, "position_scale");
  scale(config.force_scale, "force_scale");
  expect(is_rotation(config.rotation), "rotation", config.rotation.w, "a quaternion of length 1");
  expect(!axes_.isZero(0), "axes", 0, "at least one axis");
}

PoseMap PoseMap::scaled(double position_scale, double force_scale) const noexcept {
  PoseMap map = *this;
  map.position_scale_ = position_scale;
  map.force_scale_ = force_scale;
  return map;
}

Vec3 PoseMap::to_follower(const Vec3& displacement) const noexcept {
  return position_scale_ * (rotation_ * coupled_at_leader(displacement));
}

Vec3 PoseMap::to_leader(const Vec3& displacement) const noexcept {
  return coupled_at_leader(rotation_.transpose() * displacement) / position_scale_;
}

Vec3 PoseMap::force_to_leader(const Vec3& force) const noexcept {
  return force_scale_ * coupled_at_leader(rotation_.transpose() * force);
}

Vec3 PoseMap::wave_to_follower(const Vec3& wave) const noexcept {
  return std::sqrt(follower_joule()) * (rotation_ * coupled_at_leader(wave));
}

Vec3 PoseMap::wave_to_leader(const Vec3& wave) const noexcept {
  return std::sqrt(leader_joule()) * coupled_at_leader(rotation_.transpose() * wave);
}

Vec3 PoseMap::coupled_at_leader(const Vec3& vector) const noexcept { return axes_.cwiseProduct(vector); }

Vec3 PoseMap::coupled_at_follower(const Vec3& vector) const noexcept {
  return rotation_ * axes_.cwiseProduct(rotation_.transpose() * vector);
}

double PoseMap::stiffness_at_follower(double at_leader) const noexcept {
  return at_leader / (force_scale_ * position_scale_);
}

Quat PoseMap::turn_to_follower(const Quat& turn) const noexcept {
  const Vec3 axis = spin_to_follower({turn.x, turn.y, turn.z});
  return {turn.w, axis.x(), axis.y(), axis.z()};
}

Quat PoseMap::turn_to_leader(const Quat& turn) const noexcept {
  const Vec3 axis = spin_to_leader({turn.x, turn.y, turn.z});
  return {turn.w, axis.x(), axis.y(), axis.z()};
}

Vec3 PoseMap::spin_to_follower(const Vec3& spin) const noexcept { return rotation_ * spin; }

Vec3 PoseMap::spin_to_leader(const Vec3& spin) const noexcept { return rotation_.transpose() * spin; }

double PoseMap::turn_stiffness_at_follower(double at_leader) const noexcept { return at_leader * follower_joule(); }

double PoseMap::grip_stiffness_at_follower(double at_leader) const noexcept { return at_leader / force_scale_; }

double PoseMap::leader_grip_joule() const noexcept { return force_scale_; }

double PoseMap::follower_grip_joule() const noexcept { return 1 / force_scale_; }

double PoseMap::leader_joule() const noexcept { return force_scale_ / position_scale_; }

double PoseMap::follower_joule() const noexcept { return position_scale_ / force_scale_; }

}  // namespace tendon
