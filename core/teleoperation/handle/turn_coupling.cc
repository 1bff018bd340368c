// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/handle/turn_coupling.h"

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon {
namespace {

constexpr double kUnboundedTurn = std::numeric_limits<double>::infinity();

/// The gradient of 4 K (1 − |w|).
Vec3 spring(double stiffness, const Quat& rest, const Quat& q) noexcept {
  const Quat between = product(q, inverse(rest));
  return (between.w < 0 ? 2 : -2) * stiffness * Vec3(between.x, between.y, between.z);
}

}  // namespace

TurnCoupling::TurnCoupling(const Config& config, const End& end, const PoseMap& map)
    : end_(end),
      map_(map),
      config_(config),
      whole_(end.role == PortRole::kLeader ? config.stiffness : map.turn_stiffness_at_follower(config.stiffness)),
      damping_(end.role == PortRole::kLeader ? config.damping : map.turn_stiffness_at_follower(config.damping)),
      max_torque_(config.max_torque),
      stiffness_({.most = whole_, .damping = end.adapts ? damping_ : kUnboundedTurn, .period = end.period}) {
  expect_above_zero(config.stiffness, "turn.stiffness");
  expect_not_negative(config.damping, "turn.damping");
  if (end.adapts) {
    expect(config.damping > 0, "turn.damping", config.damping,
           "a number above 0 N·m·s/rad, because adapt_to_delay limits the stiffness to 2 B divided by the round-trip "
           "time");
  }
  expect(config.max_torque > 0, "turn.max_torque", config.max_torque, "a number above 0 N·m, or infinity");
}

void TurnCoupling::remap(const PoseMap& map) noexcept {
  map_ = map;
  if (leads()) return;
  whole_ = map.turn_stiffness_at_follower(config_.stiffness);
  damping_ = map.turn_stiffness_at_follower(config_.damping);
  stiffness_.become(whole_, end_.adapts ? damping_ : kUnboundedTurn);
}

void TurnCoupling::receive(const std::optional<PortTurn>& peer) noexcept {
  heard_ = peer.has_value();
  if (!peer) return;
  there_ = unit(leads() ? map_.turn_to_leader(peer->turn) : map_.turn_to_follower(peer->turn));
  spin_ = leads() ? map_.spin_to_leader(peer->angular_velocity) : map_.spin_to_follower(peer->angular_velocity);
}

void TurnCoupling::begin_act() noexcept { turn_ = !leads() && heard_ ? there_ : Quat{}; }

void TurnCoupling::move(const Quat& orientation) noexcept {
  turn_ = unit(product(unit(orientation), inverse(offset_)));
}

void TurnCoupling::follow(const Quat& orientation) noexcept {
  offset_ = unit(product(inverse(turn_), unit(orientation)));
}

bool TurnCoupling::within_reach() const noexcept { return !heard_ || is_within_reach(there_, turn_); }

Vec3 TurnCoupling::bounded(const Vec3& torque) const noexcept {
  const double size = torque.stableNorm();
  return size > max_torque_ ? Vec3(torque * (max_torque_ / size)) : torque;
}

Vec3 TurnCoupling::law(const Vec3& angular_velocity, double ahead) noexcept {
  Vec3 torque = -damping_ * angular_velocity;
  if (heard_ && (end_.springs || !leads())) {
    const Quat there = ahead > 0 ? unit(product(rotation_by(ahead * spin_), there_)) : there_;
    torque += spring(stiffness_.value(), there, turn_);
  }
  return bounded(torque);
}

Vec3 TurnCoupling::command(const Turning& hand, const CouplingPeriod& period) noexcept {
  const Quat orientation = unit(hand.orientation);
  told_ = period.live ? hand.angular_velocity : Vec3(Vec3::Zero());
  stiffness_.follow(period.round_trip);
  Vec3 torque = period.gain * law(hand.angular_velocity, period.ahead);
  if (period.placed) place_ = orientation;
  if (!period.holds) place_.reset();
  if (place_) {
    if (!is_within_reach(*place_, orientation)) place_ = orientation;
    torque += (1 - period.gain) * bounded(spring(whole_, *place_, orientation) - damping_ * hand.angular_velocity);
  }
  if (period.changed) left_ = last_ - torque;
  if (period.fade > 0) torque = bounded(torque + period.fade * left_);
  last_ = torque;
  return torque;
}

void TurnCoupling::skip(const CouplingPeriod& period) noexcept {
  stiffness_.follow(period.round_trip);
  told_.setZero();
  last_.setZero();
}

PortTurn TurnCoupling::message(const Vec3& torque) const noexcept {
  return {.turn = turn_, .angular_velocity = told_, .torque = torque};
}

}  // namespace tendon
