// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "core/teleoperation/coupling.h"
#include "core/teleoperation/port_values.h"

namespace tendon {

bool Coupling::live() const noexcept { return phase_ == PortPhase::kEngaged && (!leads() || answered_); }

/// Returns true if the peer has received the state with this sequence.
bool Coupling::heard_since(std::uint64_t sequence) const noexcept {
  return newest_.answers_epoch == config_.spring.epoch && newest_.answers >= sequence;
}

bool Coupling::peer_serves() const noexcept {
  return newest_.answers_epoch == config_.spring.epoch && newest_.engagement == engagement_ &&
         (newest_.phase == PortPhase::kEngaged || (!leads() && newest_.phase == PortPhase::kClutched));
}

bool Coupling::peer_is_ready() const noexcept {
  return newest_.phase == PortPhase::kCoupled || is_in_act(newest_.phase);
}

void Coupling::take(PhaseInput input) noexcept {
  const PortPhase to = next(phase_, input);
  if (to == phase_) return;
  if (!in_act() || !is_in_act(to)) {
    answered_ = false;
    clutch_.reset();
  }
  phase_ = to;
}

void Coupling::advance(LocalTime now, std::uint32_t buttons, bool ready) noexcept {
  elapsed_ = sequence_ > 0 ? std::max(now - now_, Duration::zero()) : Duration::zero();
  now_ = now;
  ready_ = ready;
  ++sequence_;
  loss_stage_ = loss_stages_.at(now, heard(), round_trip() / 2 > config_.max_delay);
  if (std::exchange(peer_anew_, false)) {
    seen_ = 0;
    if (!leads()) engagement_ = 0;
    disengage();
  }
  take(ready ? PhaseInput::kReady : PhaseInput::kNotReady);
  if (loss_stage_.gone) {
    if (in_act()) lost_sequence_ = sequence_;
    take(PhaseInput::kGone);
  }
  // If a fault followed the loss, the peer may not have received the loss yet.
  const bool told = lost_sequence_ == 0 || heard_since(lost_sequence_);
  if (loss_stage_.fresh && told) {
    take(PhaseInput::kHeard);
    if (phase_ != PortPhase::kFault && std::exchange(lost_sequence_, 0) > 0) spring_.forget_round_trip();
  }
  leads() ? advance_leader(buttons) : advance_follower();
  buttons_ = buttons;
}

void Coupling::advance_leader(std::uint32_t buttons) noexcept {
  if (in_act()) {
    if (peer_serves()) {
      answered_ = true;
    } else if (answered_ || !peer_is_ready() || heard_since(act_sequence_) || now_ - acted_at_ > kAnswerWithin) {
      take(PhaseInput::kEnd);
    }
  }
  if (config_.engage_by && is_pressed(buttons, buttons_, *config_.engage_by)) engage();
  if (phase_ == PortPhase::kAligning) advance_aligning();
  if (!config_.clutch || !in_act()) return;
  take(clutch_.asks(*config_.clutch, buttons, buttons_) ? PhaseInput::kClutch : PhaseInput::kRelease);
}

void Coupling::advance_aligning() noexcept {
  const Vec3 apart = frame_.coupled(u_) - frame_.mapped(newest_.position);
  alignment_.observe(apart.norm(), config_.absolute->within, now_);
  if (!peer_is_ready() || alignment_.is_overdue(now_)) {
    take(PhaseInput::kEnd);
  } else if (alignment_.is_done(now_)) {
    act();
  }
}

void Coupling::advance_follower() noexcept {
  if (in_act() && !peer_serves()) take(PhaseInput::kEnd);
  const bool acted = is_in_act(newest_.phase);
  const bool ours = newest_.answers_epoch == config_.spring.epoch;
  if (phase_ == PortPhase::kCoupled && loss_stage_.fresh && acted && ours && newest_.engagement > seen_) {
    take(PhaseInput::kAct);
    engagement_ = newest_.engagement;
    new_act_ = true;
  }
  seen_ = std::max(seen_, newest_.engagement);
}

bool Coupling::engage() noexcept {
  if (!leads()) return false;
  if (in_act() || phase_ == PortPhase::kAligning) return true;
  if (phase_ != PortPhase::kCoupled || !loss_stage_.fresh || !ready_ || !peer_is_ready()) return false;
  if (!config_.absolute) {
    act();
    return true;
  }
  take(PhaseInput::kAlign);
  alignment_.begin(now_);
  taken_ += config_.absolute->energy;
  return true;
}

void Coupling::act() noexcept {
  take(PhaseInput::kAct);
  ++engagement_;
  act_sequence_ = sequence_ + 1;
  acted_at_ = now_;
  begin_act();
}

void Coupling::begin_act() noexcept {
  if (!config_.absolute) u_ = leads() ? Vec3(Vec3::Zero()) : frame_.mapped(newest_.position);
  std::visit([this](auto& law) { law.begin_act(u_); }, law_);
  if (turn_) turn_->begin_act();
  if (grip_) grip_->begin_act();
}

void Coupling::disengage() noexcept { take(PhaseInput::kEnd); }

void Coupling::renew() noexcept {
  take(PhaseInput::kRenew);
  const std::uint64_t epoch = ++config_.spring.epoch;
  spring_.renew(epoch);
  if (tank_) tank_->renew(epoch);
  if (turn_) turn_->receive({});
  if (grip_) grip_->renew(epoch);
  newest_ = {};
  lost_sequence_ = 0;
  seen_ = 0;
  if (!leads()) engagement_ = 0;
  peer_anew_ = false;
  loss_stages_.forget(now_);
  std::visit([](auto& law) { law.forget(); }, law_);
  if (frame_.rescale_as_scene()) follow_scales();
}

bool Coupling::set_scale(double position_scale, double force_scale) noexcept {
  const auto possible = [](double scale) { return within(scale, MappedEnd::kLeast, MappedEnd::kMost); };
  const bool bound =
      phase_ == PortPhase::kEngaged || phase_ == PortPhase::kAligning || info(config_.method).keeps_scales || grip_;
  if (!leads() || bound || !possible(position_scale) || !possible(force_scale)) return false;
  if (!config_.absolute) u_ *= frame_.map().position_scale() / position_scale;
  frame_.rescale(position_scale, force_scale, true);
  follow_scales();
  return true;
}

void Coupling::follow_scales() noexcept {
  rescaled_ = true;
  std::visit([](auto& law) { law.forget(); }, law_);
  if (turn_) turn_->remap(frame_.map());
  if (!leads()) {
    spring_.become(frame_.stiffness(config_.spring.stiffness), frame_.stiffness(config_.spring.damping),
                   frame_.stiffness(config_.spring.own_damping));
  }
  if (tank_) tank_->revalue(0, frame_.joule(), frame_.worth(config_.tank->start));
}

/// Sets the scales of a follower to those of the leader. Energy is only used between two states with these scales.
void Coupling::take_scales(const PortState& peer) noexcept {
  if (info(config_.method).keeps_scales || grip_) return;
  const bool before = !heard() || frame_.tells_ours(newest_);
  if (!leads() && !frame_.tells_ours(peer)) {
    frame_.rescale_as_told(peer);
    follow_scales();
  } else if (tank_ && (!before || !frame_.tells_ours(peer))) {
    tank_->forgo(0);
  }
}

}  // namespace tendon
