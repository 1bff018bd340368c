// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/handle/grip_coupling.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kUnboundedGrip = std::numeric_limits<double>::infinity();

std::optional<EnergyTank> tank_of(const GripCoupling::End& end, const PoseMap& map) {
  if (!end.tank) return std::nullopt;
  EnergyTank::Config tank = *end.tank;
  tank.peers = 1;
  tank.joule[0] = end.role == PortRole::kLeader ? map.leader_grip_joule() : map.follower_grip_joule();
  if (end.role == PortRole::kFollower) tank.start *= map.follower_grip_joule();
  return EnergyTank(tank);
}

EnergyTankMessage tank_message(const PortState& peer) noexcept {
  return {.epoch = peer.epoch,
          .answers_epoch = peer.answers_epoch,
          .sequence = peer.sequence,
          .account = peer.grip->account,
          .need = peer.grip->need,
          .given = peer.grip->given,
          .taken = peer.grip->taken};
}

}  // namespace

GripCoupling::GripCoupling(const Config& config, const End& end, const PoseMap& map)
    : config_(config),
      end_(end),
      whole_(end.role == PortRole::kLeader ? config.stiffness : map.grip_stiffness_at_follower(config.stiffness)),
      peers_(end.role == PortRole::kLeader ? map.grip_stiffness_at_follower(config.stiffness) : config.stiffness),
      damping_(end.role == PortRole::kLeader ? config.damping : map.grip_stiffness_at_follower(config.damping)),
      stiffness_({.most = whole_, .damping = end.adapts ? damping_ : kUnboundedGrip, .period = end.period}),
      tank_(tank_of(end, map)) {
  expect_above_zero(config.stiffness, "grip.stiffness");
  expect_not_negative(config.damping, "grip.damping");
  if (end.adapts) {
    expect(config.damping > 0, "grip.damping", config.damping,
           "a number above 0 N·s/m, because adapt_to_delay limits the stiffness to 2 B divided by the round-trip time");
  }
  expect_above_zero(config.speed, "grip.speed");
  expect_above_zero(config.arm, "grip.arm");
  expect(config.max_force > 0, "grip.max_force", config.max_force, "a number above 0 N, or infinity");
}

bool GripCoupling::accepts(const PortState& peer) const noexcept {
  if (!tank_ || !peer.grip) return true;
  EnergyTank trial = *tank_;
  trial.receive(0, tank_message(peer));
  return trial.refused() == tank_->refused();
}

void GripCoupling::receive(const PortState& peer) noexcept {
  heard_ = peer.grip.has_value();
  if (!heard_) return;
  if (tank_) tank_->receive(0, tank_message(peer));
  newest_ = *peer.grip;
  came_ = true;
}

void GripCoupling::renew(std::uint64_t epoch) noexcept {
  heard_ = came_ = false;
  if (tank_) tank_->renew(epoch);
}

void GripCoupling::begin_act() noexcept { begins_ = true; }

double GripCoupling::bounded(double force) const noexcept {
  return std::clamp(force, -config_.max_force, config_.max_force);
}

void GripCoupling::approach(double target) noexcept {
  const double most = config_.speed * seconds(end_.period);
  joined_ = joined_ || std::abs(target - asked_) <= most;
  asked_ = joined_ ? target : asked_ + std::copysign(most, target - asked_);
}

/// Computes w.
void GripCoupling::lead(double opening, double velocity, const CouplingPeriod& period) noexcept {
  if (begins_) asked_ = heard_ ? newest_.opening + newest_.force / peers_ : opening;
  if (!period.live) joined_ = false;
  if (!period.in_act) asked_ = opening;
  if (period.live) approach(opening);
  told_ = asked_;
  speed_ = joined_ ? velocity : 0;
}

/// Computes z.
void GripCoupling::go_after(double opening, double there, const CouplingPeriod& period) noexcept {
  if (begins_) {
    if (place_) {
      asked_ = *place_;
    } else if (!was_driven_) {
      asked_ = opening;
    }
    joined_ = false;
  }
  if (period.driven && heard_) approach(there);
  if (!period.driven && !place_) asked_ = opening;
  told_ = opening;
}

double GripCoupling::command(const Grip& hand, const CouplingPeriod& period) noexcept {
  const double opening = config_.arm * hand.opening;
  const double velocity = config_.arm * hand.velocity;
  if (came_) stiffness_.follow(period.round_trip);
  came_ = false;
  const double there = newest_.opening + period.ahead * newest_.velocity;
  if (leads()) {
    lead(opening, velocity, period);
  } else {
    go_after(opening, there, period);
    speed_ = velocity;
  }
  begins_ = false;
  was_driven_ = period.driven;

  const double stretch = !heard_ ? 0 : leads() ? there - asked_ : asked_ - opening;
  if (period.placed) place_ = opening + spring_ / whole_;
  if (!period.holds) place_.reset();
  const double held = place_ ? whole_ * (*place_ - opening) : 0;
  spring_ = bounded(period.gain * stiffness_.value() * stretch + (1 - period.gain) * held);
  if (period.fault) spring_ = 0;
  const double damped = place_ ? damping_ : period.gain * damping_;
  double force = bounded(spring_ - damped * velocity);
  if (period.changed) left_ = last_ - force;
  if (period.fade > 0) force = bounded(force + period.fade * left_);
  last_ = force;
  return force;
}

void GripCoupling::skip(const CouplingPeriod& period) noexcept {
  if (came_) stiffness_.follow(period.round_trip);
  came_ = false;
  speed_ = 0;
  last_ = 0;
}

EnergyTank::Settlement GripCoupling::settle(const EnergyTank::Period& period) noexcept {
  return tank_ ? tank_->settle(period) : EnergyTank::Settlement{};
}

PortGrip GripCoupling::message(double force) noexcept {
  PortGrip grip{.opening = told_, .velocity = speed_, .force = force};
  if (tank_) {
    const EnergyTankMessage paid = tank_->message(0);
    grip.account = paid.account;
    grip.need = paid.need;
    grip.given = paid.given;
    grip.taken = paid.taken;
  }
  return grip;
}

}  // namespace tendon
