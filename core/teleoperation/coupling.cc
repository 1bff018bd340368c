// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/coupling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon {

namespace {

/// K, D and B of this end.
PositionPosition<3>::Config spring_of(const Coupling::Config& config, const PoseMap& map) {
  PositionPosition<3>::Config spring = config.spring;
  // The leader of a position–force coupling has no spring: the follower's is not in a loop with the delay.
  if (config.method != CouplingMethod::kPositionPosition) spring.adapt_to_delay = false;
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

// False for what is not a number.
bool fits(double value, double low, double high) noexcept { return value >= low && value <= high; }
bool fits(const Vec3& vector) noexcept { return (vector.array().abs() <= 1e12).all(); }

bool is_scale(double scale) noexcept { return scale == 0 || fits(scale, 0.01, 100); }

bool has(std::uint32_t buttons, std::uint32_t bit) noexcept { return (buttons >> bit & 1U) != 0; }

}  // namespace

std::string_view to_string(CouplingMethod method) noexcept {
  switch (method) {
    case CouplingMethod::kPositionPosition:
      return "position-position";
    case CouplingMethod::kPositionForce:
      return "position-force";
    case CouplingMethod::kWaves:
      return "waves";
    case CouplingMethod::kSurface:
      return "surface";
    case CouplingMethod::kPassivity:
      return "passivity";
    case CouplingMethod::kSetPosition:
      return "set-position";
    case CouplingMethod::kRate:
      return "rate";
  }
  return "unknown";
}

std::string_view to_string(PortPhase phase) noexcept {
  switch (phase) {
    case PortPhase::kAlone:
      return "alone: nothing is heard of the other end";
    case PortPhase::kCoupled:
      return "coupled: waits for the leader's act";
    case PortPhase::kAligning:
      return "aligning";
    case PortPhase::kEngaged:
      return "engaged";
    case PortPhase::kClutched:
      return "clutched";
    case PortPhase::kLost:
      return "lost: the other end fell silent";
    case PortPhase::kFault:
      return "waits until its device gives forces";
  }
  return "unknown";
}

bool is_sound(const PortSurface& surface) noexcept {
  return fits(surface.normal.norm(), 0.999, 1.001) && fits(surface.offset, -1e12, 1e12) &&
         fits(surface.stiffness, 0, 1e12);
}

bool is_sound(const PortTurn& turn) noexcept {
  return is_rotation(turn.turn) && fits(turn.angular_velocity) && fits(turn.torque);
}

bool is_sound(const PortGrip& grip) noexcept {
  constexpr double kAccount = PurseMessage::kMostAccount;
  constexpr double kTotal = PurseMessage::kMostTotal;
  return fits(grip.opening, -1e12, 1e12) && fits(grip.velocity, -1e12, 1e12) && fits(grip.force, -1e12, 1e12) &&
         fits(grip.account, -kAccount, kAccount) && fits(grip.need, 0, kAccount) && fits(grip.given, 0, kTotal) &&
         fits(grip.taken, 0, kTotal);
}

bool is_sound(const PortState& state) noexcept {
  constexpr Duration kMostTime = std::chrono::nanoseconds(std::int64_t{1} << 60);
  constexpr double kAccount = PurseMessage::kMostAccount;
  constexpr double kTotal = PurseMessage::kMostTotal;
  return state.epoch > 0 && state.sequence > 0 && state.time >= -kMostTime && state.time <= kMostTime &&
         state.round_trip >= Duration::zero() && state.round_trip <= PortState::kMostRoundTrip &&
         state.phase >= PortPhase::kAlone && state.phase <= PortPhase::kFault && fits(state.position) &&
         fits(state.velocity) && fits(state.force) && (!state.contact_force || fits(*state.contact_force)) &&
         fits(state.account, -kAccount, kAccount) && fits(state.need, 0, kAccount) && fits(state.given, 0, kTotal) &&
         fits(state.taken, 0, kTotal) && fits(state.wave_integral) && fits(state.wave_energy, 0, kTotal) &&
         (!state.surface || is_sound(*state.surface)) && (!state.turn || is_sound(*state.turn)) &&
         (!state.grip || is_sound(*state.grip)) && fits(state.energy_in, 0, kTotal) &&
         (!state.share || fits(*state.share, 0, 1)) && is_scale(state.position_scale) && is_scale(state.force_scale);
}

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
  if (renderer_) return newest_.surface ? at_leader(*newest_.surface, map_, 1).stiffness : 0;
  if (!wave_) return spring_.stiffness();
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
  if (grip_ && !grip_->accepts(peer)) {
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
  // It refuses none of those that are left: either all of a state is taken or nothing.
  spring_.receive({.epoch = peer.epoch,
                   .sequence = peer.sequence,
                   .answers_epoch = peer.answers_epoch,
                   .answers = peer.answers,
                   .time = peer.time,
                   .round_trip = peer.round_trip,
                   .position = mapped(peer.position),
                   .velocity = mapped(peer.velocity)});
  if (wave_) receive_wave(peer, anew);
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

void Coupling::observe(const Interval<3>& interval, double payable) noexcept {
  payable_ = payable;
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
  if (in_act()) return true;
  if (phase_ != PortPhase::kCoupled || !fresh_ || !ready_ || !peer_is_ready()) return false;
  leave(PortPhase::kEngaged);
  ++engagement_;
  act_sequence_ = sequence_ + 1;
  acted_at_ = now_;
  u_.setZero();
  if (renderer_) renderer_.emplace();
  if (wave_) wave_->forgive();
  if (turn_) turn_->begin_act();
  if (grip_) grip_->begin_act();
  return true;
}

void Coupling::disengage() noexcept {
  if (in_act()) leave(PortPhase::kCoupled);
}

/// The table of phases; see the header.
void Coupling::advance(LocalTime now, std::uint32_t buttons, bool ready) noexcept {
  elapsed_ = sequence_ > 0 ? std::max(now - now_, Duration::zero()) : Duration::zero();
  now_ = now;
  ready_ = ready;
  ++sequence_;
  const Duration age = heard() ? now - arrived_ : Duration::max();
  fresh_ = age <= patience();
  silent_ = age > patience() + kStale;
  const bool gone = age > patience() + kLostAfter;
  if (std::exchange(peer_anew_, false)) {
    seen_ = 0;
    if (!leads()) engagement_ = 0;
    if (in_act()) leave(PortPhase::kCoupled);
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
  if (!config_.clutch || !in_act()) return;
  if (pressed(config_.clutch->bit)) toggled_ = !toggled_;
  const bool clutched = config_.clutch->toggles ? toggled_ : has(buttons, config_.clutch->bit);
  phase_ = clutched ? PortPhase::kClutched : PortPhase::kEngaged;
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
  u_ = mapped(newest_.position);
  if (estimator_) estimator_.emplace(config_.surface);
  surface_.reset();
  if (wave_) wave_->forgive();
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
    offset_ = position - u_;
    if (turn_) turn_->follow(handle->turning->orientation);
  }
  was_live_ = live();
  if (turn_ && live() && !turn_->within_reach()) disengage();
}

/// Whether all that is coupled of a handle was measured.
bool Coupling::shows_handle(const HandleSample* handle) const noexcept {
  if (!turn_ && !grip_) return true;
  if (handle == nullptr) return false;
  if (turn_ &&
      (!handle->turning || !is_rotation(handle->turning->orientation) || !fits(handle->turning->angular_velocity))) {
    return false;
  }
  return !grip_ ||
         (handle->grip && fits(handle->grip->opening, -1e12, 1e12) && fits(handle->grip->velocity, -1e12, 1e12));
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
  Demand<3> demand = spring_.command(coupled(u_), speed);
  if (wave_) {
    demand = line(speed);
  } else if (leads() && config_.method != CouplingMethod::kPositionPosition) {
    demand = felt();
    demand.force = bounded(demand.force - config_.spring.own_damping * speed);
  }
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
Demand<3> Coupling::felt() noexcept {
  if (!renderer_) return {map_.force_to_leader(newest_.contact_force.value_or(Vec3::Zero()))};
  if (!live()) return {Vec3::Zero()};
  if (newest_.surface && peer_serves()) renderer_->receive(at_leader(*newest_.surface, map_, newest_.sequence));
  return renderer_->command(u_, std::max(payable_ - renderer_->energy(u_), 0.0)).demand;
}

/// The law as far as its ramp has come, and the place of a robot as far as it has not. No network is between a robot
/// and its place, so that spring has its whole stiffness.
Demand<3> Coupling::blended(const Motion& hand) noexcept {
  Demand<3> demand = law(hand.velocity);
  demand.force *= gain_;
  demand.stiffness *= gain_;
  if (!place_) return demand;
  const double stiffness = map_.stiffness_at_follower(config_.spring.stiffness);
  const double damping = map_.stiffness_at_follower(config_.spring.own_damping);
  demand.force += (1 - gain_) * bounded(stiffness * (*place_ - hand.position) - damping * hand.velocity);
  demand.stiffness += (1 - gain_) * stiffness * Mat3::Identity();
  return demand;
}

Demand<3> Coupling::command(const Motion& hand, std::uint32_t buttons, bool ready,
                            const HandleSample* handle) noexcept {
  advance(hand.at, buttons, ready);
  if (!fits(hand.position) || !fits(hand.velocity) || !shows_handle(handle)) {
    skip();
    return {Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  }
  place(hand.position, handle);
  u_velocity_ = live() ? hand.velocity : Vec3(Vec3::Zero());

  const bool turned = driven() != was_driven_ || new_act_;
  const bool ended = !driven() || (was_driven_ && new_act_);
  was_driven_ = driven();
  new_act_ = false;
  if (turned || !driven()) gain_ = 0;
  if (driven() && !turned) gain_ = std::min(1.0, gain_ + seconds(elapsed_) / seconds(config_.ramp));
  bool placed = false;
  if (phase_ == PortPhase::kFault || gain_ == 1) {
    place_.reset();
  } else if (config_.holds_place && (!place_ || (turned && ended))) {
    place_ = hand.position;
    placed = true;
  }

  Demand<3> demand = blended(hand);
  fade_ = turned ? 1 : std::max(0.0, fade_ - seconds(elapsed_) / seconds(kFade));
  if (phase_ == PortPhase::kFault) fade_ = 0;
  if (turned) left_ = last_ - demand.force;
  if (fade_ > 0) demand.force = bounded(demand.force + fade_ * left_);
  last_ = demand.force;
  if (turn_ || grip_) command_handle(*handle, turned, placed);
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
  if (fits(applied)) state.force = applied;
  if (contact && fits(*contact)) state.contact_force = contact;
  if (estimator_ && live() && state.contact_force) {
    const SurfaceModel<3> found = estimator_->observe(u_, *contact);
    surface_ = {.normal = found.normal, .offset = found.offset, .stiffness = found.stiffness};
  }
  state.surface = surface_;
  if (wave_) {
    state.wave_integral = sent_wave_.integral;
    state.wave_energy = sent_wave_.energy;
  }
  if (purse_) {
    const PurseMessage paid = purse_->message(0);
    state.account = paid.account;
    state.need = paid.need;
    state.given = paid.given;
    state.taken = paid.taken;
  }
  if (turn_) state.turn = turn_->message(fits(torque) ? torque : Vec3(Vec3::Zero()));
  if (grip_) state.grip = grip_->message(fits(grip, -1e12, 1e12) ? grip : 0);
  return state;
}

}  // namespace tendon
