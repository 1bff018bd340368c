// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/passivity_law.h"

#include "core/base/expect.h"

namespace tendon {

PassivityLaw::PassivityLaw(const CouplingConfig& config, const MappedEnd& frame) : spring_(config) {
  expect_above_zero(config.spring.own_damping, "own_damping");
  expect_not_negative(config.drift_rate, "drift_rate");
  if (frame.leads()) {
    leader_.emplace(
        PassivityLeader<3>::Config{.max_damping = config.spring.own_damping, .period = config.spring.period});
  } else {
    follower_.emplace(PassivityFollower<3>::Config{.drift_rate = config.drift_rate,
                                                   .period = config.spring.period,
                                                   .stiffness = frame.stiffness(config.spring.stiffness)});
  }
}

void PassivityLaw::receive(const PortState& peer, const PortState& before, bool anew, const MappedEnd& frame) noexcept {
  if (!anew) heard_energy_ += frame.joule() * (peer.energy_in - before.energy_in);
  ++heard_sequence_;
  if (leader_) {
    leader_->receive(
        {.sequence = heard_sequence_, .force = -frame.map().force_to_leader(peer.force), .energy_in = heard_energy_});
  }
  if (follower_) {
    follower_->receive({.sequence = heard_sequence_,
                        .velocity = frame.mapped(peer.velocity),
                        .displacement = frame.mapped(peer.position),
                        .energy_in = heard_energy_});
  }
}

void PassivityLaw::begin_act(const Vec3& u) noexcept {
  spring_.begin(u);
  if (follower_) follower_->begin(u);
}

std::optional<EnergyTank::Settlement> PassivityLaw::observe(const LawInterval& ended) noexcept {
  if (leader_ && ended.was_live) energy_in_ = leader_->observe(ended.interval).energy_in;
  return std::nullopt;
}

Demand<3> PassivityLaw::command(const LawPeriod& period, const Vec3& speed, const Demand<3>& /*spring*/) noexcept {
  if (!leader_) return spring_.command(period, speed);
  Demand<3> demand = leader_->command(speed);
  demand.force -= spring_.own_damping * speed;
  return demand;
}

void PassivityLaw::conclude(const LawPeriod& period, const Vec3& applied,
                            const std::optional<Vec3>& /*contact*/) noexcept {
  if (!follower_ || !period.live) return;
  const auto step = follower_->step(applied);
  spring_.place = follower_->displacement();
  spring_.velocity = step.velocity;
  energy_in_ = step.message.energy_in;
}

}  // namespace tendon
