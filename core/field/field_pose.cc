// SPDX-License-Identifier: Apache-2.0
#include "core/field/field_pose.h"

#include <algorithm>

#include "core/base/rotation.h"

namespace tendon::field {
namespace {

Quat small_turn(const Vec3& angle) noexcept { return unit({1, 0.5 * angle.x(), 0.5 * angle.y(), 0.5 * angle.z()}); }

/// Scales a small rotation by `share`.
Quat faded(const Quat& q, double share) noexcept {
  const double sign = q.w < 0 ? -1.0 : 1.0;
  return unit({share * sign * q.w + (1 - share), share * sign * q.x, share * sign * q.y, share * sign * q.z});
}

}  // namespace

Vec3 Pose::to_base(const Vec3& local) const noexcept { return rotated(turn, local) + position; }

Vec3 Pose::to_object(const Vec3& x) const noexcept { return rotated(inverse(turn), x - position); }

bool FieldPose::observe(const TimedPose& pose) noexcept {
  if (!(pose.pose.position.norm() <= TimedPose::kMostPosition) || !is_rotation(pose.pose.turn) ||
      !(pose.velocity.norm() <= TimedPose::kMostSpeed) || !(pose.angular_velocity.norm() <= TimedPose::kMostRate)) {
    return false;
  }
  fresh_ = placed_;
  newest_ = pose;
  newest_->pose.turn = unit(pose.pose.turn);
  return true;
}

Pose FieldPose::expected(LocalTime now) const noexcept {
  const double lead = seconds(std::clamp(now - newest_->at, -kMostLead, kMostLead));
  return {.position = newest_->pose.position + newest_->velocity * lead,
          .turn = product(small_turn(newest_->angular_velocity * lead), newest_->pose.turn)};
}

Pose FieldPose::at(LocalTime now, double period) noexcept {
  if (!newest_) return used_;
  const Pose target = expected(now);
  if (fresh_) {
    rest_ = used_.position - target.position;
    turn_rest_ = product(used_.turn, inverse(target.turn));
    fresh_ = false;
  }
  placed_ = true;
  const double share = kFade / (kFade + period);
  rest_ *= share;
  turn_rest_ = faded(turn_rest_, share);
  used_ = {.position = target.position + rest_, .turn = unit(product(turn_rest_, target.turn))};
  return used_;
}

}  // namespace tendon::field
