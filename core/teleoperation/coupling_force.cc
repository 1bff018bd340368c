// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/rotation.h"
#include "core/teleoperation/coupling.h"
#include "core/teleoperation/port_values.h"
#include "core/teleoperation/shares.h"

namespace tendon {

bool Coupling::driven() const noexcept {
  const bool holds = config_.holds_place && std::visit([](const auto& law) { return law.kHoldsSilent; }, law_);
  return live() && (!loss_stage_.silent || holds);
}

bool Coupling::rests_at_zero() const noexcept {
  return leads() && std::visit([](const auto& law) { return law.kLeaderCentred; }, law_);
}

/// Updates u if the end is live, and p₀ otherwise.
void Coupling::place(const Vec3& position, const HandleSample* handle) noexcept {
  if (new_act_) begin_act();
  if (live() && was_live_ && !new_act_) {
    u_ = position - offset_;
    if (turn_) turn_->move(handle->turning->orientation);
  } else {
    if (rests_at_zero()) u_.setZero();
    offset_ = position - u_;
    if (turn_) turn_->follow(handle->turning->orientation);
  }
  if (config_.absolute) u_ = position;
  was_live_ = live();
  if (turn_ && live() && !turn_->within_reach()) disengage();
}

bool Coupling::shows_handle(const HandleSample* handle) const noexcept {
  if (!turn_ && !grip_) return true;
  if (handle == nullptr) return false;
  if (turn_ &&
      (!handle->turning || !is_rotation(handle->turning->orientation) || !within(handle->turning->angular_velocity))) {
    return false;
  }
  return !grip_ ||
         (handle->grip && within(handle->grip->opening, -1e12, 1e12) && within(handle->grip->velocity, -1e12, 1e12));
}

CouplingPeriod Coupling::period(bool changed, bool placed) const noexcept {
  return {.in_act = in_act(),
          .live = live(),
          .driven = driven(),
          .changed = changed,
          .placed = placed,
          .holds = place_.has_value(),
          .fault = phase_ == PortPhase::kFault,
          .gain = ramp_.gain(),
          .fade = ramp_.fading(),
          .round_trip = round_trip(),
          .ahead = spring_.ahead()};
}

LawPeriod Coupling::law_period() const noexcept {
  return {.frame = frame_,
          .peer = newest_,
          .u = u_,
          .live = live(),
          .clutched = phase_ == PortPhase::kClutched,
          .fresh = loss_stage_.fresh,
          .serves = peer_serves(),
          .payable = payable_,
          .stiffness = spring_.stiffness()};
}

void Coupling::command_handle(const HandleSample& handle, bool changed, bool placed) noexcept {
  const CouplingPeriod now = period(changed, placed);
  if (turn_) torque_ = turn_->command(*handle.turning, now);
  if (grip_) grip_force_ = grip_->command(*handle.grip, now);
}

/// Returns the force of the law along the coupled axes, without the ramp. Must be called in each period.
Demand<3> Coupling::law(const Vec3& velocity) noexcept {
  const Vec3 speed = frame_.coupled(velocity);
  Demand<3> demand = std::visit(
      [&](auto& law) {
        const double energy = law.kSpringPays ? payable_ : std::numeric_limits<double>::infinity();
        const Demand<3> spring = spring_.command(frame_.coupled(u_), speed, energy);
        return law.command(law_period(), speed, spring);
      },
      law_);
  demand.force = at_most(demand.force, config_.spring.max_force);
  for (int i = 0; i < 3; ++i) demand.stiffness.col(i) = frame_.coupled(demand.stiffness.col(i));
  return demand;
}

/// Returns the gain g of the ramp times the law. A robot adds 1 − g times the spring that holds its position.
Demand<3> Coupling::blended(const Motion& hand) noexcept {
  Demand<3> demand = law(hand.velocity);
  const PositionPosition<3>::Config& spring = config_.spring;
  if (phase_ == PortPhase::kAligning) {
    return {alignment_.force(
        frame_.mapped(newest_.position), frame_.coupled(hand.position), frame_.coupled(hand.velocity),
        {.stiffness = spring.stiffness, .damping = spring.own_damping, .max_force = spring.max_force}, elapsed_)};
  }
  demand.force *= ramp_.gain();
  demand.stiffness *= ramp_.gain();
  if (place_) {
    const double held = 1 - std::max(ramp_.gain(), others_);
    const double stiffness = frame_.map().stiffness_at_follower(spring.stiffness);
    const double damping = frame_.map().stiffness_at_follower(spring.own_damping);
    demand.force +=
        held * at_most(Vec3(stiffness * (*place_ - hand.position) - damping * hand.velocity), spring.max_force);
    demand.stiffness += held * stiffness * Mat3::Identity();
  }
  demand.force *= share_;
  demand.stiffness *= share_;
  return demand;
}

void Coupling::set_share(double share, double others) noexcept {
  if (!config_.share) return;
  share_ = share;
  // If a leader is lost, this value decreases slowly.
  others_ = std::max(others, others_ - seconds(elapsed_) / seconds(ForceRamp::kFade));
}

void Coupling::follow_share() noexcept {
  if (!leads()) return;
  const double most = ramp_.gain() > 0 ? seconds(elapsed_) / seconds(Shares::kHandOver) : 1;
  share_ = std::clamp(newest_.share.value_or(1), share_ - most, share_ + most);
}

/// Returns true if the position that a robot holds is new.
bool Coupling::hold_place(const Vec3& position, const ForceRamp::Change& change) noexcept {
  if (phase_ == PortPhase::kFault || ramp_.gain() == 1 || others_ == 1) {
    place_.reset();
    return false;
  }
  if (!config_.holds_place || (place_ && !(change.turned && change.ended))) return false;
  place_ = position;
  return true;
}

Demand<3> Coupling::command(const Motion& hand, std::uint32_t buttons, bool ready,
                            const HandleSample* handle) noexcept {
  advance(hand.at, buttons, ready);
  if (!within(hand.position) || !within(hand.velocity) || !shows_handle(handle)) {
    skip();
    return {Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  }
  place(hand.position, handle);
  u_velocity_ = live() ? hand.velocity : Vec3(Vec3::Zero());

  const bool aligns = phase_ == PortPhase::kAligning;
  const ForceRamp::Change change = ramp_.drive(driven(), std::exchange(new_act_, false), elapsed_, config_.ramp);
  const bool placed = hold_place(hand.position, change);

  follow_share();
  Demand<3> demand = blended(hand);
  const bool stepped = change.turned || std::exchange(rescaled_, false) || aligns != was_aligning_;
  was_aligning_ = aligns;
  demand.force = ramp_.fade(demand.force, stepped, phase_ == PortPhase::kFault, elapsed_, config_.spring.max_force);
  if (turn_ || grip_) command_handle(*handle, stepped, placed);
  return demand;
}

void Coupling::skip() noexcept {
  spring_.command(frame_.coupled(u_), Vec3::Zero());
  std::visit([this](auto& law) { law.skip(law_period(), elapsed_); }, law_);
  u_velocity_.setZero();
  if (rests_at_zero()) u_.setZero();
  was_live_ = was_live_ && live();
  ramp_.skip(driven(), elapsed_);
  if (turn_) turn_->skip(period(false, false));
  if (grip_) grip_->skip(period(false, false));
  torque_.setZero();
  grip_force_ = 0;
}

void Coupling::command_unseen(LocalTime now, bool ready) noexcept {
  advance(now, buttons_, ready);
  skip();
}

}  // namespace tendon
