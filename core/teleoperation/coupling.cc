// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/coupling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

namespace {

/// Gaps between states are remembered for one to two of these.
constexpr Duration kRecovery = std::chrono::seconds(5);
/// A longer gap is no habit of the network but a loss.
constexpr Duration kMostGap = std::chrono::milliseconds(100);

/// K, D and B of this end.
PositionPosition<3>::Config spring_of(const Coupling::Config& config) {
  PositionPosition<3>::Config spring = config.spring;
  // The leader of a position–force coupling has no spring: the follower's is not in a loop with the delay.
  if (config.method == CouplingMethod::kPositionForce) spring.adapt_to_delay = false;
  if (config.role == PortRole::kLeader) return spring;
  const PoseMap map(config.map);
  for (double* const value : {&spring.stiffness, &spring.damping, &spring.own_damping}) {
    *value = map.stiffness_at_follower(*value);
  }
  return spring;
}

std::optional<Purse> purse_of(const Coupling::Config& config, const PoseMap& map) {
  if (!config.purse) return std::nullopt;
  Purse::Config purse = *config.purse;
  purse.peers = 1;
  purse.joule[0] = config.role == PortRole::kLeader ? map.leader_joule() : map.follower_joule();
  purse.epoch = config.spring.epoch;
  return Purse(purse);
}

bool within(const Vec3& vector) noexcept { return (vector.array().abs() <= 1e12).all(); }
bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

Vec3 shortened(const Vec3& force, double most) noexcept {
  const double size = force.stableNorm();
  return size > most ? Vec3(force * (most / size)) : force;
}

}  // namespace

bool is_sound(const PortState& state) noexcept {
  constexpr Duration kMostTime = std::chrono::nanoseconds(std::int64_t{1} << 60);
  constexpr double kAccount = PurseMessage::kMostAccount;
  constexpr double kTotal = PurseMessage::kMostTotal;
  return state.epoch > 0 && state.sequence > 0 && state.time >= -kMostTime && state.time <= kMostTime &&
         state.round_trip >= Duration::zero() && state.round_trip <= PortState::kMostRoundTrip &&
         state.phase >= PortPhase::kAlone && state.phase <= PortPhase::kFault && within(state.position) &&
         within(state.velocity) && within(state.force) && (!state.contact_force || within(*state.contact_force)) &&
         within(state.account, -kAccount, kAccount) && within(state.need, 0, kAccount) &&
         within(state.given, 0, kTotal) && within(state.taken, 0, kTotal);
}

Coupling::Coupling(const Config& config)
    : config_(config), map_(config.map), spring_(spring_of(config)), purse_(purse_of(config, map_)) {
  const auto refuse_of = [&](bool there, const char* field, PortRole only) {
    expect(!there || config.role == only, field, 1,
           only == PortRole::kLeader ? "none: only a leader has one" : "none: only a follower has one");
  };
  refuse_of(config.clutch.has_value(), "clutch", PortRole::kLeader);
  refuse_of(config.engage_by.has_value(), "engage_by", PortRole::kLeader);
  refuse_of(config.holds_place, "holds_place", PortRole::kFollower);
  if (config.clutch) expect(config.clutch->bit <= 31, "clutch.bit", config.clutch->bit, "0 to 31");
  if (config.engage_by) {
    expect(*config.engage_by <= 31, "engage_by", *config.engage_by, "0 to 31");
    expect(!config.clutch || config.clutch->bit != *config.engage_by, "engage_by", *config.engage_by,
           "another button than the clutch's");
  }
  expect_above_zero(seconds(config.ramp), "ramp");
  expect_above_zero(seconds(config.peer_period), "peer_period");
}

void Coupling::receive(const PortState& peer, LocalTime now) noexcept {
  if (!is_sound(peer)) {
    ++refused_;
    return;
  }
  const bool new_epoch = peer.epoch > peer_.epoch;
  if (!new_epoch && (peer.epoch < peer_.epoch || peer.sequence <= peer_.sequence)) return;
  // Either all of a state is taken or nothing: purse and spring hear of the same epochs.
  if (purse_) {
    const std::uint64_t before = purse_->refused();
    purse_->receive(0, {.epoch = peer.epoch,
                        .answers_epoch = peer.answers_epoch,
                        .sequence = peer.sequence,
                        .account = peer.account,
                        .need = peer.need,
                        .given = peer.given,
                        .taken = peer.taken});
    if (purse_->refused() != before) {
      ++refused_;
      return;
    }
  }
  const std::uint64_t before = spring_.refused();
  spring_.receive({.epoch = peer.epoch,
                   .sequence = peer.sequence,
                   .answers_epoch = peer.answers_epoch,
                   .answers = peer.answers,
                   .time = peer.time,
                   .round_trip = peer.round_trip,
                   .position = mapped(peer.position),
                   .velocity = mapped(peer.velocity)});
  if (spring_.refused() != before) {
    ++refused_;
    return;
  }
  if (new_epoch) {
    begin_epoch(peer);
  } else {
    gap_ = std::max(gap_, std::min(now - peer_at_, kMostGap));
  }
  peer_ = peer;
  peer_at_ = now;
  const bool follows = phase_ == PortPhase::kCoupled || phase_ == PortPhase::kEngaged;
  if (!leads() && !follows) seen_ = std::max(seen_, peer.engagement);
}

/// A peer that starts anew knows of no act, and the first act heard of may be an old one.
void Coupling::begin_epoch(const PortState& peer) noexcept {
  if (phase_ == PortPhase::kEngaged || phase_ == PortPhase::kClutched) leave(PortPhase::kCoupled);
  seen_ = peer.engagement;
  gap_ = gap_before_ = Duration::zero();
}

bool Coupling::engage() noexcept {
  if (!leads()) return false;
  if (phase_ == PortPhase::kEngaged || phase_ == PortPhase::kClutched) return true;
  const bool peer_ready = peer_.phase == PortPhase::kCoupled || peer_.phase == PortPhase::kEngaged;
  if (phase_ != PortPhase::kCoupled || !fresh() || !peer_ready) return false;
  ++engagement_;
  phase_ = PortPhase::kEngaged;
  joined_ = wants_clutch_ = after_clutch_ = false;
  acted_at_ = now_;
  return true;
}

void Coupling::disengage() noexcept {
  if (phase_ == PortPhase::kEngaged || phase_ == PortPhase::kClutched) leave(PortPhase::kCoupled);
}

Duration Coupling::stale_after() const noexcept {
  return std::max({kStale, 3 * config_.peer_period, 2 * std::max(gap_, gap_before_)});
}

bool Coupling::peer_is_in_act() const noexcept {
  const bool in = peer_.phase == PortPhase::kEngaged || (!leads() && peer_.phase == PortPhase::kClutched);
  return in && peer_.engagement == engagement_;
}

void Coupling::watch(LocalTime now) noexcept {
  elapsed_ = now_ == LocalTime{} ? Duration::zero() : std::max(now - now_, Duration::zero());
  now_ = now;
  age_ = heard() ? now - peer_at_ : Duration::zero();
  if (now - stretch_began_ < kRecovery) return;
  stretch_began_ = now;
  gap_before_ = std::exchange(gap_, Duration::zero());
}

void Coupling::take_buttons(std::uint32_t buttons) noexcept {
  const std::uint32_t pressed = buttons & ~std::exchange(buttons_, buttons);
  const auto has = [](std::uint32_t set, std::uint32_t bit) { return (set >> bit & 1) != 0; };
  if (config_.clutch) {
    const Button& clutch = *config_.clutch;
    if (!clutch.toggles) {
      wants_clutch_ = has(buttons, clutch.bit);
    } else if (has(pressed, clutch.bit)) {
      wants_clutch_ = !wants_clutch_;
    }
  }
  if (config_.engage_by && has(pressed, *config_.engage_by)) engage();
}

void Coupling::leave(PortPhase next) noexcept {
  stop_living();
  phase_ = next;
  joined_ = after_clutch_ = false;
  if (!leads() && next != PortPhase::kCoupled) seen_ = std::max(seen_, peer_.engagement);
}

void Coupling::stop_living() noexcept {
  if (!std::exchange(live_, false)) return;
  fading_ = fade_from_ = given_;
  gain_ = 0;
  u_velocity_.setZero();
}

/// The table of phases; see the header.
void Coupling::change_phase(bool ready) noexcept {
  if (!ready) {
    if (phase_ != PortPhase::kFault) leave(PortPhase::kFault);
    held_at_.reset();
    return;
  }
  if (phase_ == PortPhase::kFault) phase_ = PortPhase::kAlone;
  const bool silent = !heard() || age_ > stale_after() + kLostAfter;
  switch (phase_) {
    case PortPhase::kAlone:
      if (!silent) phase_ = PortPhase::kCoupled;
      break;
    case PortPhase::kLost:
      if (fresh()) phase_ = PortPhase::kCoupled;
      break;
    case PortPhase::kCoupled:
      if (silent) {
        phase_ = PortPhase::kAlone;
      } else if (!leads() && fresh() && peer_.phase == PortPhase::kEngaged && peer_.engagement > seen_) {
        phase_ = PortPhase::kEngaged;
        engagement_ = seen_ = peer_.engagement;
      }
      break;
    case PortPhase::kEngaged:
    case PortPhase::kClutched:
      if (silent) {
        leave(PortPhase::kLost);
      } else if (peer_is_in_act()) {
        joined_ = true;
        if (leads()) phase_ = wants_clutch_ ? PortPhase::kClutched : PortPhase::kEngaged;
      } else if (joined_ || !leads() || now_ - acted_at_ > kAnswerWithin) {
        leave(PortPhase::kCoupled);
      }
      break;
    case PortPhase::kAligning:
    case PortPhase::kFault:
      break;
  }
  if (phase_ == PortPhase::kClutched && live_) {
    stop_living();
    after_clutch_ = true;
  }
}

Vec3 Coupling::mapped(const Vec3& displacement) const noexcept {
  return leads() ? map_.to_leader(displacement) : map_.to_follower(displacement);
}

Vec3 Coupling::coupled(const Vec3& vector) const noexcept {
  return leads() ? map_.coupled_at_leader(vector) : map_.coupled_at_follower(vector);
}

/// Keeps u as it is for the peer, or sets it to where the law has no force.
void Coupling::live_on(const Vec3& position) noexcept {
  const bool should = phase_ == PortPhase::kEngaged && joined_ && peer_is_in_act();
  if (!should || live_) return;
  live_ = true;
  if (!std::exchange(after_clutch_, false)) u_ = mapped(peer_.position);
  offset_ = position - u_;
  gain_ = 0;
}

/// Of whole gain. The spring counts periods, so it is asked in each.
Demand<3> Coupling::law(const Vec3& displacement, const Vec3& velocity) noexcept {
  Demand<3> demand = spring_.command(displacement, velocity);
  if (leads() && config_.method == CouplingMethod::kPositionForce) {
    demand.force = shortened(
        map_.force_to_leader(peer_.contact_force.value_or(Vec3::Zero())) - config_.spring.own_damping * velocity,
        config_.spring.max_force);
    demand.stiffness.setZero();
  }
  demand.force = coupled(demand.force);
  for (int i = 0; i < 3; ++i) demand.stiffness.col(i) = coupled(demand.stiffness.col(i));
  return demand;
}

/// A robot's own spring to the place where it is to stay. No network is in it, so its stiffness is whole.
Vec3 Coupling::hold(const Motion& hand) noexcept {
  if (!held_at_) held_at_ = hand.position;
  const double stiffness = map_.stiffness_at_follower(config_.spring.stiffness);
  const double damping = map_.stiffness_at_follower(config_.spring.own_damping);
  return shortened(stiffness * (*held_at_ - hand.position) - damping * hand.velocity, config_.spring.max_force);
}

Demand<3> Coupling::command(const Motion& hand, std::uint32_t buttons, bool ready) noexcept {
  watch(hand.at);
  take_buttons(buttons);
  change_phase(ready);
  live_on(hand.position);
  if (live_) {
    u_ = hand.position - offset_;
    u_velocity_ = hand.velocity;
  }
  Demand<3> demand = law(u_, u_velocity_);
  const bool felt = live_ && (config_.holds_place || age_ <= stale_after() + kStale);
  const double step = seconds(elapsed_) / seconds(felt ? config_.ramp : kFade);
  gain_ = live_ ? std::clamp(gain_ + (felt ? step : -step), 0.0, 1.0) : 0;
  demand.force *= gain_;
  demand.stiffness *= gain_;
  given_ = demand.force;

  const double left = seconds(elapsed_) / seconds(kFade);
  const double size = fading_.norm();
  const double less = left * fade_from_.norm();
  fading_ = size > less ? Vec3(fading_ * ((size - less) / size)) : Vec3(Vec3::Zero());
  demand.force += fading_;
  if (config_.holds_place && ready) {
    if (gain_ < 1) {
      demand.force += (1 - gain_) * hold(hand);
    } else {
      held_at_.reset();
    }
  }
  if (!ready) return {Vec3::Zero() + 0 * hand.position};
  return demand;
}

void Coupling::command_unseen(LocalTime now, bool ready) noexcept {
  watch(now);
  change_phase(ready);
  u_velocity_.setZero();
  law(u_, u_velocity_);
  gain_ = 0;
  given_.setZero();
  fading_.setZero();
}

Purse::Settlement Coupling::settle(double payable, double loss, Duration elapsed) noexcept {
  if (!purse_) return {};
  const bool giving = live_ && phase_ == PortPhase::kEngaged && peer_.phase == PortPhase::kEngaged;
  return purse_->settle({.payable = payable, .loss = loss, .elapsed = elapsed, .giving = giving});
}

PortState Coupling::message(const Vec3& applied, const std::optional<Vec3>& contact) noexcept {
  const PortMotion<3> motion = spring_.message();
  PortState state;
  state.epoch = motion.epoch;
  state.sequence = motion.sequence;
  state.answers_epoch = motion.answers_epoch;
  state.answers = motion.answers;
  state.time = motion.time;
  state.round_trip = std::min(motion.round_trip, PortState::kMostRoundTrip);
  state.phase = phase_;
  state.engagement = engagement_;
  state.buttons = buttons_;
  state.position = u_;
  state.velocity = u_velocity_;
  state.force = applied;
  state.contact_force = contact;
  if (purse_) {
    const PurseMessage paid = purse_->message(0);
    state.account = paid.account;
    state.need = paid.need;
    state.given = paid.given;
    state.taken = paid.taken;
  }
  return state;
}

bool Coupling::live() const noexcept { return live_; }
double Coupling::account() const noexcept { return purse_ ? purse_->account() : 0; }
bool Coupling::contact_measured() const noexcept { return peer_.contact_force.has_value(); }
std::uint64_t Coupling::refused() const noexcept { return refused_; }

}  // namespace tendon
