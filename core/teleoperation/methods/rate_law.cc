// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/rate_law.h"

#include <algorithm>

#include "core/base/expect.h"

namespace tendon {

RateLaw::RateLaw(const CouplingConfig& config, const MappedEnd& /*frame*/)
    : rate_(config.rate.value_or(RateControl{})),
      centring_(config.centring),
      max_force_(config.spring.max_force),
      period_(config.spring.period),
      spring_(config) {
  expect_not_negative(rate_.dead_zone, "rate.dead_zone");
  expect_above_zero(rate_.gain, "rate.gain");
  expect_above_zero(rate_.max_speed, "rate.max_speed");
}

Demand<3> RateLaw::command(const LawPeriod& period, const Vec3& speed, const Demand<3>& /*spring*/) noexcept {
  if (period.frame.leads()) return centred(period, speed);
  spring_.velocity = asked_velocity(period);
  const Vec3 tool = period.frame.coupled(period.u);
  const Vec3 ahead = spring_.place + seconds(period_) * spring_.velocity - tool;
  // The distance is limited so that the follower can turn back without a delay.
  const double farthest = max_force_ / period.stiffness;
  const double distance = ahead.norm();
  spring_.place = tool + (distance > farthest ? Vec3(ahead * (farthest / distance)) : ahead);
  return spring_.command(period, speed);
}

/// Limits the contact force so that it does not move the handle out of the dead zone.
Demand<3> RateLaw::centred(const LawPeriod& period, const Vec3& speed) const noexcept {
  Vec3 contact = period.frame.map().force_to_leader(period.peer.contact_force.value_or(Vec3::Zero()));
  const double most = centring_ * rate_.dead_zone;
  const double size = contact.norm();
  if (size > most) contact *= most / size;
  return {contact - centring_ * period.frame.coupled(period.u) - spring_.own_damping * speed,
          centring_ * Mat3::Identity()};
}

Vec3 RateLaw::asked_velocity(const LawPeriod& period) const noexcept {
  if (!period.live || !period.fresh || period.peer.phase != PortPhase::kEngaged) return Vec3::Zero();
  const PoseMap& map = period.frame.map();
  const Vec3 handle = map.coupled_at_leader(period.peer.position);
  const double away = handle.norm();
  const double beyond = away - rate_.dead_zone;
  if (!(beyond > 0)) return Vec3::Zero();
  return map.to_follower(handle * (std::min(rate_.gain * beyond, rate_.max_speed) / away));
}

double RateLaw::stiffness(const LawPeriod& period, double share, Duration /*round_trip*/) const noexcept {
  return period.frame.leads() ? centring_ : share * period.stiffness;
}

}  // namespace tendon
