// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/coupling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/base/expect.h"
#include "core/base/rotation.h"
#include "core/teleoperation/port_values.h"
#include "core/teleoperation/shares.h"

namespace tendon {

namespace {

/// K, D and B of this end.
PositionPosition<3>::Config spring_of(const Coupling::Config& config, const PoseMap& map) {
  PositionPosition<3>::Config spring = config.spring;
  const bool both = config.method == CouplingMethod::kPositionPosition || config.method == CouplingMethod::kSetPosition;
  // The leader of a position–force coupling has no spring: the follower's is not in a loop with the delay.
  if (!both) spring.adapt_to_delay = false;
  if (config.method == CouplingMethod::kSetPosition) spring.damping = 0;  // no velocity travels
  if (config.role == PortRole::kLeader) return spring;
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
  // The same at both ends: the end whose joules are worth less would else be left with too little.
  if (config.role == PortRole::kFollower) purse.start *= map.follower_joule();
  purse.epoch = config.spring.epoch;
  return Purse(purse);
}

std::optional<WavePort<3>> wave_of(const Coupling::Config& config, const PoseMap& map) {
  if (config.method != CouplingMethod::kWaves) return std::nullopt;
  const bool leads = config.role == PortRole::kLeader;
  const double impedance = leads ? config.spring.own_damping : map.stiffness_at_follower(config.spring.own_damping);
  expect_above_zero(impedance, "own_damping");
  // Moving at most as fast as max_force/B while max_force is felt.
  const double max_wave = 2 * config.spring.max_force / std::sqrt(2 * impedance);
  return WavePort<3>({.impedance = impedance,
                      .period = config.spring.period,
                      .smoothing = std::max<Duration>(config.spring.period, std::chrono::milliseconds(20)),
                      .max_wave = max_wave});
}

/// The surface that a follower found, in the leader's frame and scale. With m = the coupled part of Rᵀ n_f,
///     F_l = s_f s_x K_f (d/s_x − m·u_l)₊ m
SurfaceModel<3> at_leader(const PortSurface& from, const PoseMap& map, std::uint64_t sequence) {
  const double stiffer = 1 / map.stiffness_at_follower(1);  // s_f s_x
  const double scale = std::sqrt(stiffer / map.leader_joule());
  const Vec3 m = scale * map.to_leader(from.normal);
  const double length = m.norm();
  if (!(length > 1e-3)) return {.sequence = sequence};  // it lies across the axes that are coupled
  return {.sequence = sequence,
          .normal = m / length,
          .offset = from.offset / (scale * length),
          .stiffness = stiffer * from.stiffness * length * length};
}

/// Of the others only one leader at a time can be right.
bool can_be_shared(CouplingMethod method) noexcept {
  return method == CouplingMethod::kPositionPosition || method == CouplingMethod::kPositionForce;
}

bool has(std::uint32_t buttons, std::uint32_t bit) noexcept { return (buttons >> bit & 1U) != 0; }

}  // namespace

Coupling::Coupling(const Config& config)
    : config_(config),
      map_(config.map),
      spring_(spring_of(config, map_)),
      purse_(purse_of(config, map_)),
      wave_(wave_of(config, map_)) {
  if (config.method == CouplingMethod::kSurface) {
    if (leads()) {
      renderer_.emplace();
    } else {
      estimator_.emplace(config.surface);
    }
  }
  if (config.absolute) {
    expect(has_places(config.method), "absolute", 1, "none: this method has no absolute places");
    expect(!config.clutch, "clutch", 1, "none: an absolute map has no offset that it could change");
    expect_above_zero(config.absolute->within, "absolute.within");
    expect_not_negative(config.absolute->energy, "absolute.energy");
  }
  const auto refuse_of = [&](bool there, const char* field, PortRole only) {
    expect(!there || config.role == only, field, 1,
           only == PortRole::kLeader ? "none: only a leader has one" : "none: only a follower has one");
  };
  refuse_of(config.clutch.has_value(), "clutch", PortRole::kLeader);
  refuse_of(config.engage_by.has_value(), "engage_by", PortRole::kLeader);
  refuse_of(config.holds_place, "holds_place", PortRole::kFollower);
  refuse_of(config.share.has_value(), "share", PortRole::kFollower);
  if (config.share) {
    expect(within(*config.share, 0, 1), "share", *config.share, "0 to 1");
    if (!can_be_shared(config.method)) {
      throw std::invalid_argument("method: expected position-position or position-force with several leaders, found " +
                                  std::string(to_string(config.method)));
    }
    share_ = *config.share;
  }
  if (config.clutch) expect(config.clutch->bit <= 31, "clutch.bit", config.clutch->bit, "0 to 31");
  if (config.engage_by) {
    expect(*config.engage_by <= 31, "engage_by", *config.engage_by, "0 to 31");
    expect(!config.clutch || config.clutch->bit != *config.engage_by, "engage_by", *config.engage_by,
           "another button than the clutch's");
  }
  if (config.method == CouplingMethod::kPassivity) {
    expect_above_zero(config.spring.own_damping, "own_damping");
    if (leads()) {
      passive_leader_.emplace(
          PassivityLeader<3>::Config{.max_damping = config.spring.own_damping, .period = config.spring.period});
    } else {
      passive_follower_.emplace(PassivityFollower<3>::Config{
          .drift_rate = config.drift_rate, .period = config.spring.period, .stiffness = spring_.stiffness()});
    }
  }
  const bool by_rate = config.method == CouplingMethod::kRate;
  expect(config.rate.has_value() == by_rate, "rate", config.rate ? 1 : 0, "one of method rate, and of no other");
  if (config.rate) {
    expect_not_negative(config.rate->dead_zone, "rate.dead_zone");
    expect_above_zero(config.rate->gain, "rate.gain");
    expect_above_zero(config.rate->max_speed, "rate.max_speed");
  }
  expect_not_negative(config.drift_rate, "drift_rate");
  expect_not_negative(config.centring, "centring");
  refuse_of(config.centring > 0, "centring", PortRole::kLeader);
  expect_above_zero(seconds(config.max_delay), "max_delay");
  if (config.turn) {
    // The other methods have no spring at the leader, so the follower's is in no loop with the delay.
    const bool springs = config.method == CouplingMethod::kPositionPosition || config.method == CouplingMethod::kWaves;
    turn_.emplace(*config.turn,
                  TurnCoupling::End{.role = config.role,
                                    .springs = springs,
                                    .adapts = springs && config.spring.adapt_to_delay,
                                    .period = config.spring.period},
                  map_);
  }
  if (config.grip) {
    GripCoupling::End end{.role = config.role, .adapts = config.spring.adapt_to_delay, .period = config.spring.period};
    end.purse = config.purse;
    if (end.purse) end.purse->epoch = config.spring.epoch;
    grip_.emplace(*config.grip, end, map_);
  }
  expect_above_zero(seconds(config.ramp), "ramp");
  expect_above_zero(seconds(config.peer_period), "peer_period");
}

Vec3 Coupling::mapped(const Vec3& displacement) const noexcept {
  return leads() ? map_.to_leader(displacement) : map_.to_follower(displacement);
}

Vec3 Coupling::coupled(const Vec3& vector) const noexcept {
  return leads() ? map_.coupled_at_leader(vector) : map_.coupled_at_follower(vector);
}

Vec3 Coupling::bounded(const Vec3& force) const noexcept {
  const double most = config_.spring.max_force;
  const double size = force.stableNorm();
  return size > most ? Vec3(force * (most / size)) : force;
}

bool Coupling::live() const noexcept { return phase_ == PortPhase::kEngaged && (!leads() || answered_); }
double Coupling::stiffness() const noexcept {
  if (rests_at_zero()) return config_.centring;
  if (renderer_) return newest_.surface ? at_leader(*newest_.surface, map_, 1).stiffness : 0;
  if (!wave_) return share_ * spring_.stiffness();
  // B/d, with half of the round trip for one way.
  const double impedance = config_.spring.own_damping * (leads() ? 1 : map_.stiffness_at_follower(1));
  return impedance / (seconds(round_trip()) / 2 + seconds(wave_->playout() + kLineWaits));
}
double Coupling::account() const noexcept { return purse_ ? purse_->account() : 0; }
bool Coupling::contact_measured() const noexcept { return newest_.contact_force.has_value(); }
std::uint64_t Coupling::refused() const noexcept { return refused_; }

void Coupling::receive(const PortState& peer, LocalTime now) noexcept {
  const bool ours = peer.answers_epoch == config_.spring.epoch;
  if (!is_sound(peer) || (ours && peer.answers > sequence_)) {
    ++refused_;
    return;
  }
  const bool anew = peer.epoch > newest_.epoch;
  if (!anew && (peer.epoch < newest_.epoch || peer.sequence <= newest_.sequence)) return;
  if ((!anew && peer.energy_in < newest_.energy_in) || (grip_ && !grip_->accepts(peer))) {
    ++refused_;
    return;
  }
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
  take_scales(peer);
  // It refuses none of those that are left: either all of a state is taken or nothing.
  spring_.receive(
      {.epoch = peer.epoch,
       .sequence = peer.sequence,
       .answers_epoch = peer.answers_epoch,
       .answers = peer.answers,
       .time = peer.time,
       .round_trip = peer.round_trip,
       .position = mapped(peer.position),
       .velocity = config_.method == CouplingMethod::kSetPosition ? Vec3(Vec3::Zero()) : mapped(peer.velocity)});
  if (wave_) receive_wave(peer, anew);
  receive_energy(peer, anew);
  if (turn_) turn_->receive(peer.turn);
  if (grip_) grip_->receive(peer);
  if (anew) {
    peer_anew_ = true;
    if (renderer_) renderer_.emplace();
    gap_ = gap_before_ = Duration::zero();
    stretch_began_ = now;
  } else if (phase_ != PortPhase::kLost && phase_ != PortPhase::kAlone) {
    if (now - stretch_began_ >= kGapsKept) {
      stretch_began_ = now;
      gap_before_ = std::exchange(gap_, Duration::zero());
    }
    gap_ = std::max(gap_, std::min(now - arrived_, kMostGap));
  }
  newest_ = peer;
  arrived_ = now;
}

void Coupling::receive_wave(const PortState& peer, bool anew) noexcept {
  const bool leader = leads();
  const WaveMessage<3> wave{
      .sequence = peer.sequence,
      .time = peer.time,
      .integral = leader ? map_.wave_to_leader(peer.wave_integral) : map_.wave_to_follower(peer.wave_integral),
      .energy = peer.wave_energy * (leader ? map_.leader_joule() : map_.follower_joule())};
  if (anew || !wave_joined_) {
    wave_->join(wave);
    wave_joined_ = true;
  } else {
    wave_->receive(wave);
  }
}

/// Of passivity. What a peer took in before this port heard of its epoch may have been used already.
void Coupling::receive_energy(const PortState& peer, bool anew) noexcept {
  const double joule = leads() ? map_.leader_joule() : map_.follower_joule();
  if (!anew) heard_energy_ += joule * (peer.energy_in - newest_.energy_in);
  ++heard_sequence_;
  if (passive_leader_) {
    passive_leader_->receive(
        {.sequence = heard_sequence_, .force = -map_.force_to_leader(peer.force), .energy_in = heard_energy_});
  }
  if (passive_follower_) {
    passive_follower_->receive({.sequence = heard_sequence_,
                                .velocity = mapped(peer.velocity),
                                .displacement = mapped(peer.position),
                                .energy_in = heard_energy_});
  }
}

void Coupling::observe(const Interval<3>& interval, double payable) noexcept {
  payable_ = payable;
  if (passive_leader_ && was_live_) {
    energy_in_ =
        passive_leader_
            ->observe({.applied = coupled(interval.applied), .dx = coupled(interval.dx), .held = interval.held})
            .energy_in;
  }
  if (!wave_) return;
  Interval<3> end{.applied = wave_force_, .dx = Vec3::Zero(), .held = interval.held};
  if (wave_moves_) {
    end.dx = coupled(interval.dx);
    // A cut by limiter or motors makes the end of the line softer; the ramp does not.
    end.applied = coupled(interval.applied) + wave_force_ - coupled(last_);
  }
  sent_wave_ = wave_->observe(end, {.payable = payable, .reserve = loss_, .wanted = wave_force_});
  taken_ = wave_->taken();
  given_ = wave_->given();
}

Duration Coupling::patience() const noexcept {
  return std::max({kStale, 3 * config_.peer_period, 2 * std::max(gap_, gap_before_)});
}

/// Whether the peer's newest state was made after it heard what we sent in that period.
bool Coupling::heard_since(std::uint64_t sequence) const noexcept {
  return newest_.answers_epoch == config_.spring.epoch && newest_.answers >= sequence;
}

/// Whether the peer is engaged by our act, and knows that it is ours.
bool Coupling::peer_serves() const noexcept {
  return newest_.answers_epoch == config_.spring.epoch && newest_.engagement == engagement_ &&
         (newest_.phase == PortPhase::kEngaged || (!leads() && newest_.phase == PortPhase::kClutched));
}

bool Coupling::peer_is_ready() const noexcept {
  return newest_.phase == PortPhase::kCoupled || newest_.phase == PortPhase::kEngaged ||
         newest_.phase == PortPhase::kClutched;
}

void Coupling::leave(PortPhase to) noexcept {
  phase_ = to;
  answered_ = toggled_ = false;
}

bool Coupling::engage() noexcept {
  if (!leads()) return false;
  if (in_act() || phase_ == PortPhase::kAligning) return true;
  if (phase_ != PortPhase::kCoupled || !fresh_ || !ready_ || !peer_is_ready()) return false;
  if (!config_.absolute) {
    act();
    return true;
  }
  leave(PortPhase::kAligning);
  aligning_since_ = apart_at_ = now_;
  guide_.reset();
  taken_ += config_.absolute->energy;
  return true;
}

void Coupling::act() noexcept {
  leave(PortPhase::kEngaged);
  ++engagement_;
  act_sequence_ = sequence_ + 1;
  acted_at_ = now_;
  if (!config_.absolute) u_.setZero();
  if (renderer_) renderer_.emplace();
  if (wave_) wave_->forgive();
  if (turn_) turn_->begin_act();
  if (grip_) grip_->begin_act();
}

void Coupling::disengage() noexcept {
  if (in_act() || phase_ == PortPhase::kAligning) leave(PortPhase::kCoupled);
}

void Coupling::renew() noexcept {
  disengage();
  if (phase_ != PortPhase::kFault) phase_ = PortPhase::kAlone;
  const std::uint64_t epoch = ++config_.spring.epoch;
  spring_.renew(epoch);
  if (purse_) purse_->renew(epoch);
  if (turn_) turn_->receive({});
  if (grip_) grip_->renew(epoch);
  newest_ = {};
  lost_sequence_ = 0;
  seen_ = 0;
  if (!leads()) engagement_ = 0;
  peer_anew_ = false;
  gap_ = gap_before_ = Duration::zero();
  stretch_began_ = now_;
  wave_joined_ = false;
  if (renderer_) renderer_.emplace();
  if (!leads() && scaled_) rescale(config_.map.position_scale, config_.map.force_scale);
  if (!leads()) scaled_ = false;
}

bool Coupling::set_scale(double position_scale, double force_scale) noexcept {
  const bool bound =
      phase_ == PortPhase::kEngaged || phase_ == PortPhase::kAligning || keeps_scales(config_.method) || grip_;
  if (!leads() || bound || !within(position_scale, 0.01, 100) || !within(force_scale, 0.01, 100)) return false;
  if (!config_.absolute) u_ *= map_.position_scale() / position_scale;
  rescale(position_scale, force_scale);
  scaled_ = true;
  return true;
}

void Coupling::rescale(double position_scale, double force_scale) noexcept {
  const double joule = map_.leader_joule();
  map_ = map_.scaled(position_scale, force_scale);
  rescaled_ = true;
  if (renderer_) renderer_.emplace();
  if (turn_) turn_->remap(map_);
  if (!leads()) {
    const auto at_follower = [this](double at_leader) { return map_.stiffness_at_follower(at_leader); };
    spring_.become(at_follower(config_.spring.stiffness), at_follower(config_.spring.damping),
                   at_follower(config_.spring.own_damping));
    // The account is worth no more to the leader than it was.
    if (map_.leader_joule() > joule) kept_ *= joule / map_.leader_joule();
  }
  if (!purse_) return;
  const double start = config_.purse->start * (leads() ? 1 : map_.follower_joule());
  purse_->revalue(0, leads() ? map_.leader_joule() : map_.follower_joule(), start);
}

/// Whether it was made with the scales that are in use here. 0 stands for those of the scene.
bool Coupling::tells_our_scales(const PortState& peer) const noexcept {
  const auto told = [](double scale, double of_scene) { return scale > 0 ? scale : of_scene; };
  return told(peer.position_scale, config_.map.position_scale) == map_.position_scale() &&
         told(peer.force_scale, config_.map.force_scale) == map_.force_scale();
}

/// A follower takes the leader's. Energy counts only between two states that both tell the scales in use: between
/// others nobody knows at which worth it was given.
void Coupling::take_scales(const PortState& peer) noexcept {
  if (keeps_scales(config_.method) || grip_) return;
  const bool before = !heard() || tells_our_scales(newest_);
  if (!leads() && !tells_our_scales(peer)) {
    const bool told = peer.position_scale > 0 && peer.force_scale > 0;
    rescale(told ? peer.position_scale : config_.map.position_scale, told ? peer.force_scale : config_.map.force_scale);
    scaled_ = told;
  } else if (purse_ && (!before || !tells_our_scales(peer))) {
    purse_->forgo(0);
  }
}

/// The table of phases; see the header.
void Coupling::advance(LocalTime now, std::uint32_t buttons, bool ready) noexcept {
  elapsed_ = sequence_ > 0 ? std::max(now - now_, Duration::zero()) : Duration::zero();
  now_ = now;
  ready_ = ready;
  ++sequence_;
  const Duration age = heard() ? now - arrived_ : Duration::max();
  const bool late = round_trip() / 2 > config_.max_delay;
  fresh_ = !late && age <= patience();
  silent_ = late || age > patience() + kStale;
  const bool gone = late || age > patience() + kLostAfter;
  if (std::exchange(peer_anew_, false)) {
    seen_ = 0;
    if (!leads()) engagement_ = 0;
    disengage();
  }
  if (!ready) {
    leave(PortPhase::kFault);
  } else if (phase_ == PortPhase::kFault) {
    phase_ = PortPhase::kAlone;
  }
  if (phase_ == PortPhase::kCoupled && gone) phase_ = PortPhase::kAlone;
  if (in_act() && gone) {
    leave(PortPhase::kLost);
    lost_sequence_ = sequence_;
  }
  // A fault after the loss does not make the peer know of it.
  const bool told = lost_sequence_ == 0 || heard_since(lost_sequence_);
  if (phase_ == PortPhase::kAligning && gone) phase_ = PortPhase::kAlone;
  if ((phase_ == PortPhase::kAlone || phase_ == PortPhase::kLost) && fresh_ && told) {
    phase_ = PortPhase::kCoupled;
    if (std::exchange(lost_sequence_, 0) > 0) spring_.forget_round_trip();
  }
  leads() ? advance_leader(buttons) : advance_follower();
  buttons_ = buttons;
}

void Coupling::advance_leader(std::uint32_t buttons) noexcept {
  const auto pressed = [&](std::uint32_t bit) { return has(buttons, bit) && !has(buttons_, bit); };
  if (in_act()) {
    if (peer_serves()) {
      answered_ = true;
    } else if (answered_ || !peer_is_ready() || heard_since(act_sequence_) || now_ - acted_at_ > kAnswerWithin) {
      leave(PortPhase::kCoupled);
    }
  }
  if (config_.engage_by && pressed(*config_.engage_by)) engage();
  if (phase_ == PortPhase::kAligning) advance_aligning();
  if (!config_.clutch || !in_act()) return;
  if (pressed(config_.clutch->bit)) toggled_ = !toggled_;
  const bool clutched = config_.clutch->toggles ? toggled_ : has(buttons, config_.clutch->bit);
  phase_ = clutched ? PortPhase::kClutched : PortPhase::kEngaged;
}

/// The handle's newest place is that of the period before.
void Coupling::advance_aligning() noexcept {
  const Vec3 apart = coupled(u_) - mapped(newest_.position);
  if (!(apart.norm() <= config_.absolute->within)) apart_at_ = now_;
  if (!peer_is_ready() || now_ - aligning_since_ > kAlignWithin) {
    leave(PortPhase::kCoupled);
  } else if (now_ - apart_at_ >= kAligned) {
    act();
  }
}

void Coupling::advance_follower() noexcept {
  if (in_act() && !peer_serves()) leave(PortPhase::kCoupled);
  const bool acted = newest_.phase == PortPhase::kEngaged || newest_.phase == PortPhase::kClutched;
  const bool ours = newest_.answers_epoch == config_.spring.epoch;
  if (phase_ == PortPhase::kCoupled && fresh_ && acted && ours && newest_.engagement > seen_) {
    leave(PortPhase::kEngaged);
    engagement_ = newest_.engagement;
    new_act_ = true;
  }
  seen_ = std::max(seen_, newest_.engagement);
}

/// Whether the law makes the force.
bool Coupling::driven() const noexcept { return live() && (!silent_ || (config_.holds_place && !wave_)); }

void Coupling::begin_act() noexcept {
  if (!config_.absolute) u_ = mapped(newest_.position);
  if (estimator_) estimator_.emplace(config_.surface);
  surface_.reset();
  if (wave_) wave_->forgive();
  reference_ = u_;
  reference_velocity_.setZero();
  if (passive_follower_) passive_follower_->begin(reference_);
  if (turn_) turn_->begin_act();
  if (grip_) grip_->begin_act();
}

/// p₀ follows the handle while u stands still, and the other way round.
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

/// Whether all that is coupled of a handle was measured.
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
          .gain = gain_,
          .fade = fade_,
          .round_trip = round_trip(),
          .ahead = spring_.ahead()};
}

void Coupling::command_handle(const HandleSample& handle, bool changed, bool placed) noexcept {
  const CouplingPeriod now = period(changed, placed);
  if (turn_) torque_ = turn_->command(*handle.turning, now);
  if (grip_) grip_force_ = grip_->command(*handle.grip, now);
}

/// Of whole gain, along the coupled axes. Spring and line count periods, so they are asked in each.
Demand<3> Coupling::law(const Vec3& velocity) noexcept {
  const Vec3 speed = coupled(velocity);
  const bool pays = config_.method == CouplingMethod::kSetPosition;
  Demand<3> demand = spring_.command(coupled(u_), speed, pays ? payable_ : std::numeric_limits<double>::infinity());
  switch (config_.method) {
    case CouplingMethod::kPositionPosition:
    case CouplingMethod::kSetPosition:
      break;
    case CouplingMethod::kWaves:
      demand = line(speed);
      break;
    case CouplingMethod::kPositionForce:
    case CouplingMethod::kSurface:
      if (leads()) demand = felt(speed);
      break;
    case CouplingMethod::kPassivity:
      demand = leads() ? passive_leader_->command(speed) : following(speed);
      if (leads()) demand.force -= config_.spring.own_damping * speed;
      break;
    case CouplingMethod::kRate:
      demand = leads() ? centred(speed) : following(speed);
      break;
  }
  demand.force = bounded(demand.force);
  for (int i = 0; i < 3; ++i) demand.stiffness.col(i) = coupled(demand.stiffness.col(i));
  return demand;
}

Demand<3> Coupling::line(const Vec3& speed) noexcept {
  const bool holds = phase_ == PortPhase::kClutched;
  wave_moves_ = live();
  Demand<3> demand = wave_->command(wave_moves_ ? speed : Vec3(Vec3::Zero()));
  demand.force = bounded(demand.force);
  wave_force_ = wave_moves_ || holds ? demand.force : Vec3(Vec3::Zero());
  return demand;
}

/// By the leader, of what the follower touches.
Demand<3> Coupling::felt(const Vec3& speed) noexcept {
  Demand<3> demand{Vec3::Zero()};
  if (!renderer_) {
    demand.force = map_.force_to_leader(newest_.contact_force.value_or(Vec3::Zero()));
  } else if (live()) {
    if (newest_.surface && peer_serves()) renderer_->receive(at_leader(*newest_.surface, map_, newest_.sequence));
    demand = renderer_->command(u_, std::max(payable_ - renderer_->energy(u_), 0.0)).demand;
  }
  demand.force -= config_.spring.own_damping * speed;
  return demand;
}

/// By the leader of rate. The contact force alone holds the handle within the dead zone.
Demand<3> Coupling::centred(const Vec3& speed) noexcept {
  Vec3 contact = map_.force_to_leader(newest_.contact_force.value_or(Vec3::Zero()));
  const double most = config_.centring * config_.rate->dead_zone;
  const double size = contact.norm();
  if (size > most) contact *= most / size;
  return {contact - config_.centring * coupled(u_) - config_.spring.own_damping * speed,
          config_.centring * Mat3::Identity()};
}

/// m/s, of the follower's reference: what the leader's handle asks for.
Vec3 Coupling::asked_velocity() const noexcept {
  if (!live() || !fresh_ || newest_.phase != PortPhase::kEngaged) return Vec3::Zero();
  const Vec3 handle = map_.coupled_at_leader(newest_.position);
  const double away = handle.norm();
  const double beyond = away - config_.rate->dead_zone;
  if (!(beyond > 0)) return Vec3::Zero();
  return map_.to_follower(handle * (std::min(config_.rate->gain * beyond, config_.rate->max_speed) / away));
}

/// By a follower of passivity or rate, whose spring pulls its tool to its own reference.
Demand<3> Coupling::following(const Vec3& speed) noexcept {
  const double stiffness = spring_.stiffness();
  const Vec3 tool = coupled(u_);
  if (config_.rate) {
    reference_velocity_ = asked_velocity();
    const Vec3 ahead = reference_ + seconds(config_.spring.period) * reference_velocity_ - tool;
    // No farther than its force reaches: it turns back at once.
    const double farthest = config_.spring.max_force / stiffness;
    const double distance = ahead.norm();
    reference_ = tool + (distance > farthest ? Vec3(ahead * (farthest / distance)) : ahead);
  }
  const double mutual = map_.stiffness_at_follower(config_.spring.damping);
  const double own = map_.stiffness_at_follower(config_.spring.own_damping);
  return {stiffness * (reference_ - tool) + mutual * (reference_velocity_ - speed) - own * speed,
          stiffness * Mat3::Identity()};
}

/// Towards where the follower is: the far end of a spring leaves the handle at kAlignSpeed.
Demand<3> Coupling::aligning(const Motion& hand) noexcept {
  const Vec3 there = mapped(newest_.position);
  if (!guide_) guide_ = coupled(hand.position);
  const Vec3 left = there - *guide_;
  const double way = kAlignSpeed * seconds(elapsed_);
  *guide_ = left.norm() > way ? Vec3(*guide_ + left * (way / left.norm())) : there;
  Vec3 force = config_.spring.stiffness * (*guide_ - coupled(hand.position)) -
               config_.spring.own_damping * coupled(hand.velocity);
  const double most = std::min(kAlignForce, config_.spring.max_force);
  if (force.stableNorm() > most) force *= most / force.stableNorm();
  return {force};
}

/// The law as far as its ramp has come, and the place of a robot as far as it has not. No network is between a robot
/// and its place, so that spring has its whole stiffness.
Demand<3> Coupling::blended(const Motion& hand) noexcept {
  Demand<3> demand = law(hand.velocity);
  if (phase_ == PortPhase::kAligning) return aligning(hand);
  demand.force *= gain_;
  demand.stiffness *= gain_;
  if (place_) {
    const double held = 1 - std::max(gain_, others_);
    const double stiffness = map_.stiffness_at_follower(config_.spring.stiffness);
    const double damping = map_.stiffness_at_follower(config_.spring.own_damping);
    demand.force += held * bounded(stiffness * (*place_ - hand.position) - damping * hand.velocity);
    demand.stiffness += held * stiffness * Mat3::Identity();
  }
  demand.force *= share_;
  demand.stiffness *= share_;
  return demand;
}

void Coupling::set_share(double share, double others) noexcept {
  if (!config_.share) return;
  share_ = share;
  // A leader that has gone leaves the place to be taken up slowly.
  others_ = std::max(others, others_ - seconds(elapsed_) / seconds(kFade));
}

void Coupling::follow_share() noexcept {
  if (!leads()) return;
  const double most = gain_ > 0 ? seconds(elapsed_) / seconds(Shares::kHandOver) : 1;
  share_ = std::clamp(newest_.share.value_or(1), share_ - most, share_ + most);
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
  const bool turned = driven() != was_driven_ || new_act_;
  const bool ended = !driven() || (was_driven_ && new_act_);
  was_driven_ = driven();
  new_act_ = false;
  if (turned || !driven()) gain_ = 0;
  if (driven() && !turned) gain_ = std::min(1.0, gain_ + seconds(elapsed_) / seconds(config_.ramp));
  bool placed = false;
  if (phase_ == PortPhase::kFault || gain_ == 1 || others_ == 1) {
    place_.reset();
  } else if (config_.holds_place && (!place_ || (turned && ended))) {
    place_ = hand.position;
    placed = true;
  }

  follow_share();
  Demand<3> demand = blended(hand);
  const bool stepped = turned || std::exchange(rescaled_, false) || aligns != was_aligning_;
  was_aligning_ = aligns;
  fade_ = stepped ? 1 : std::max(0.0, fade_ - seconds(elapsed_) / seconds(kFade));
  if (phase_ == PortPhase::kFault) fade_ = 0;
  if (stepped) left_ = last_ - demand.force;
  if (fade_ > 0) demand.force = bounded(demand.force + fade_ * left_);
  last_ = demand.force;
  if (turn_ || grip_) command_handle(*handle, stepped, placed);
  return demand;
}

/// A period that has no position: no force, and the longer that is so, the more of the ramp is to be gone again.
void Coupling::skip() noexcept {
  spring_.command(coupled(u_), Vec3::Zero());
  if (wave_) {
    // Nobody saw the interval that ends now, nor sees the next one: nothing is paid for what the line sends.
    wave_->observe({.applied = wave_force_, .dx = Vec3::Zero(), .held = elapsed_},
                   {.payable = -std::numeric_limits<double>::max(), .wanted = wave_force_});
    line(Vec3::Zero());
  }
  u_velocity_.setZero();
  if (rests_at_zero()) u_.setZero();
  was_live_ = was_live_ && live();
  was_driven_ = was_driven_ && driven();
  last_.setZero();
  const double share = seconds(elapsed_) / seconds(kFade);
  gain_ = std::max(0.0, gain_ - share);
  fade_ = std::max(0.0, fade_ - share);
  if (turn_) turn_->skip(period(false, false));
  if (grip_) grip_->skip(period(false, false));
  torque_.setZero();
  grip_force_ = 0;
}

void Coupling::command_unseen(LocalTime now, bool ready) noexcept {
  advance(now, buttons_, ready);
  skip();
}

bool Coupling::gives() const noexcept { return live() && !silent_ && newest_.phase == PortPhase::kEngaged; }

Purse::Settlement Coupling::settle(double payable, double loss, Duration elapsed) noexcept {
  loss_ = loss;
  Purse::Settlement settlement{.credit = std::exchange(taken_, 0), .withdraw = std::exchange(given_, 0)};
  settlement.withdraw += (1 - std::exchange(kept_, 1)) * std::max(payable, 0.0);
  if (!purse_) return settlement;
  const double left = payable + settlement.credit - settlement.withdraw;
  const auto paid = purse_->settle({.payable = left, .loss = loss, .elapsed = elapsed, .giving = gives()});
  settlement.credit += paid.credit;
  settlement.withdraw += paid.withdraw;
  return settlement;
}

Purse::Settlement Coupling::settle_grip(double payable, double loss, Duration elapsed) noexcept {
  if (!grip_) return {};
  return grip_->settle({.payable = payable, .loss = loss, .elapsed = elapsed, .giving = gives()});
}

PortState Coupling::message(const Vec3& applied, const std::optional<Vec3>& contact, const Vec3& torque,
                            double grip) noexcept {
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
  if (within(applied)) state.force = applied;
  if (contact && within(*contact)) state.contact_force = contact;
  if (estimator_ && live() && state.contact_force) {
    const SurfaceModel<3> found = estimator_->observe(u_, *contact);
    surface_ = {.normal = found.normal, .offset = found.offset, .stiffness = found.stiffness};
  }
  state.surface = surface_;
  if (scaled_) {
    state.position_scale = map_.position_scale();
    state.force_scale = map_.force_scale();
  }
  if (config_.share) state.share = share_;
  if (passive_follower_ && live()) {
    const auto step = passive_follower_->step(coupled(applied));
    reference_ = passive_follower_->displacement();
    reference_velocity_ = step.velocity;
    energy_in_ = step.message.energy_in;
  }
  state.energy_in = std::min(energy_in_, PurseMessage::kMostTotal);
  if (wave_) {
    state.wave_integral = sent_wave_.integral;
    state.wave_energy = sent_wave_.energy;
  }
  if (purse_) {
    const PurseMessage paid = purse_->message(0);
    // A leader answers for its part of the follower only (Couplings).
    const double part = leads() ? 1 : share_;
    state.account = part * paid.account;
    state.need = part * paid.need;
    state.given = paid.given;
    state.taken = paid.taken;
  }
  if (turn_) state.turn = turn_->message(within(torque) ? torque : Vec3(Vec3::Zero()));
  if (grip_) state.grip = grip_->message(within(grip, -1e12, 1e12) ? grip : 0);
  return state;
}

}  // namespace tendon
