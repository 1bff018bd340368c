// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/coupling.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/base/expect.h"
#include "core/teleoperation/port_values.h"

namespace tendon {

namespace {

/// Removes values that are not used by the method. Throws std::invalid_argument if the configuration is not valid.
CouplingConfig checked(CouplingConfig config) {
  const auto reasons = check(config);
  if (!reasons.empty()) {
    throw std::invalid_argument(std::string(reasons.front().key) + ": " + reasons.front().sentence);
  }
  if (!info(config.method).has_velocity) config.spring.damping = 0;
  return config;
}

PositionPosition<3>::Config spring_of(const CouplingConfig& config, const MappedEnd& frame) {
  PositionPosition<3>::Config spring = config.spring;
  // The leader of a position–force coupling has no spring, so the follower's spring is not in a loop with the delay.
  if (!info(config.method).has_springs) spring.adapt_to_delay = false;
  for (double* const value : {&spring.stiffness, &spring.damping, &spring.own_damping}) {
    *value = frame.stiffness(*value);
  }
  return spring;
}

std::optional<EnergyTank> tank_of(const CouplingConfig& config, const MappedEnd& frame) {
  if (!config.tank) return std::nullopt;
  EnergyTank::Config tank = *config.tank;
  tank.peers = 1;
  tank.joule[0] = frame.joule();
  // The value of `start` must be equal at both ends, or it would be too small at the end with the smaller joule.
  tank.start = frame.worth(tank.start);
  tank.epoch = config.spring.epoch;
  return EnergyTank(tank);
}

std::optional<TurnCoupling> turn_of(const CouplingConfig& config, const MappedEnd& frame) {
  if (!config.turn) return std::nullopt;
  // For the other methods, there is no spring at the leader, so the follower's spring is not in a loop with the delay.
  const bool springs = config.method == CouplingMethod::kPositionPosition || config.method == CouplingMethod::kWaves;
  return TurnCoupling(*config.turn,
                      TurnCoupling::End{.role = config.role,
                                        .springs = springs,
                                        .adapts = springs && config.spring.adapt_to_delay,
                                        .period = config.spring.period},
                      frame.map());
}

std::optional<GripCoupling> grip_of(const CouplingConfig& config, const MappedEnd& frame) {
  if (!config.grip) return std::nullopt;
  GripCoupling::End end{.role = config.role, .adapts = config.spring.adapt_to_delay, .period = config.spring.period};
  end.tank = config.tank;
  if (end.tank) end.tank->epoch = config.spring.epoch;
  return GripCoupling(*config.grip, end, frame.map());
}

}  // namespace

Coupling::Coupling(const Config& config)
    : config_(checked(config)),
      frame_(config.map, config.role),
      spring_(spring_of(config_, frame_)),
      tank_(tank_of(config, frame_)),
      law_(coupling_law_of(config, frame_)),
      loss_stages_(config.peer_period) {
  if (config.absolute) {
    expect_above_zero(config.absolute->within, "absolute.within");
    expect_not_negative(config.absolute->energy, "absolute.energy");
  }
  if (config.share) {
    expect(within(*config.share, 0, 1), "share", *config.share, "0 to 1");
    share_ = *config.share;
  }
  if (config.clutch) expect(config.clutch->bit <= 31, "clutch.bit", config.clutch->bit, "0 to 31");
  if (config.engage_by) {
    expect(*config.engage_by <= 31, "engage_by", *config.engage_by, "0 to 31");
    expect(!config.clutch || config.clutch->bit != *config.engage_by, "engage_by", *config.engage_by,
           "a different button than that of the clutch");
  }
  expect_not_negative(config.drift_rate, "drift_rate");
  expect_not_negative(config.centring, "centring");
  expect_above_zero(seconds(config.max_delay), "max_delay");
  turn_ = turn_of(config, frame_);
  grip_ = grip_of(config, frame_);
  expect_above_zero(seconds(config.ramp), "ramp");
  expect_above_zero(seconds(config.peer_period), "peer_period");
}

double Coupling::stiffness() const noexcept {
  return std::visit([this](const auto& law) { return law.stiffness(law_period(), share_, round_trip()); }, law_);
}
double Coupling::account() const noexcept { return tank_ ? tank_->account() : 0; }
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
  if (tank_) {
    const std::uint64_t before = tank_->refused();
    tank_->receive(0, {.epoch = peer.epoch,
                       .answers_epoch = peer.answers_epoch,
                       .sequence = peer.sequence,
                       .account = peer.account,
                       .need = peer.need,
                       .given = peer.given,
                       .taken = peer.taken});
    if (tank_->refused() != before) {
      ++refused_;
      return;
    }
  }
  take_scales(peer);
  const bool has_velocity = info(config_.method).has_velocity;
  // PositionPosition accepts every state that passed the checks above, so a state is never used only partially.
  std::visit(
      [&](auto& law) {
        spring_.receive({.epoch = peer.epoch,
                         .sequence = peer.sequence,
                         .answers_epoch = peer.answers_epoch,
                         .answers = peer.answers,
                         .time = peer.time,
                         .round_trip = peer.round_trip,
                         .position = frame_.mapped(peer.position),
                         .velocity = has_velocity ? frame_.mapped(peer.velocity) : Vec3(Vec3::Zero())});
        law.receive(peer, newest_, anew, frame_);
      },
      law_);
  if (turn_) turn_->receive(peer.turn);
  if (grip_) grip_->receive(peer);
  if (anew) {
    peer_anew_ = true;
    loss_stages_.forget(now);
  }
  loss_stages_.receive(now, !anew && phase_ != PortPhase::kLost && phase_ != PortPhase::kAlone);
  newest_ = peer;
}

void Coupling::observe(const Interval<3>& interval, double payable) noexcept {
  payable_ = payable;
  const LawInterval ended{.interval = {.applied = frame_.coupled(interval.applied),
                                       .dx = frame_.coupled(interval.dx),
                                       .held = interval.held},
                          .was_live = was_live_,
                          .wanted = frame_.coupled(ramp_.force()),
                          .payable = payable,
                          .reserve = loss_};
  const auto line = std::visit([&](auto& law) { return law.observe(ended); }, law_);
  if (!line) return;
  taken_ = line->credit;
  given_ = line->withdraw;
}

bool Coupling::gives() const noexcept { return live() && !loss_stage_.silent && newest_.phase == PortPhase::kEngaged; }

EnergyTank::Settlement Coupling::settle(double payable, double loss, Duration elapsed) noexcept {
  loss_ = loss;
  EnergyTank::Settlement settlement{.credit = std::exchange(taken_, 0), .withdraw = std::exchange(given_, 0)};
  settlement.withdraw += (1 - frame_.take_kept()) * std::max(payable, 0.0);
  if (!tank_) return settlement;
  const double left = payable + settlement.credit - settlement.withdraw;
  const auto paid = tank_->settle({.payable = left, .loss = loss, .elapsed = elapsed, .giving = gives()});
  settlement.credit += paid.credit;
  settlement.withdraw += paid.withdraw;
  return settlement;
}

EnergyTank::Settlement Coupling::settle_grip(double payable, double loss, Duration elapsed) noexcept {
  if (!grip_) return {};
  return grip_->settle({.payable = payable, .loss = loss, .elapsed = elapsed, .giving = gives()});
}

void Coupling::conclude(const Vec3& applied, const std::optional<Vec3>& contact, const Vec3& torque,
                        double grip) noexcept {
  told_ = {};
  if (within(applied)) told_.force = applied;
  if (contact && within(*contact)) told_.contact_force = contact;
  std::visit([&](auto& law) { law.conclude(law_period(), frame_.coupled(applied), told_.contact_force); }, law_);
  if (tank_) {
    const EnergyTankMessage paid = tank_->message(0);
    // The account of a leader only covers its share of the follower.
    const double part = leads() ? 1 : share_;
    told_.account = part * paid.account;
    told_.need = part * paid.need;
    told_.given = paid.given;
    told_.taken = paid.taken;
  }
  if (turn_) told_.turn = turn_->message(within(torque) ? torque : Vec3(Vec3::Zero()));
  if (grip_) told_.grip = grip_->message(within(grip, -1e12, 1e12) ? grip : 0);
}

PortState Coupling::message() const noexcept {
  const PortMotion<3> motion = spring_.message();
  PortState state = told_;
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
  const LawPart part = std::visit([](const auto& law) { return law.part(); }, law_);
  state.surface = part.surface;
  state.energy_in = std::min(part.energy_in, EnergyTankMessage::kMostTotal);
  state.wave_integral = part.wave.integral;
  state.wave_energy = part.wave.energy;
  if (frame_.told()) {
    state.position_scale = frame_.map().position_scale();
    state.force_scale = frame_.map().force_scale();
  }
  if (config_.share) state.share = share_;
  return state;
}

}  // namespace tendon
