// SPDX-License-Identifier: Apache-2.0
#include "core/haptic_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/base/rotation.h"
#include "core/control/force_limits.h"

namespace tendon {

HapticController::HapticController(const Config& config)
    : config_(config), limiter_(config.limiter), held_({.hold = config.hold, .rules = config.channels}) {
  expect_above_zero(config.max_force, "max_force");
  expect(config.max_slew > 0, "max_slew", config.max_slew, "a number above 0 N/s, or infinity");
  if (config.max_speed) expect(*config.max_speed > 0, "max_speed", *config.max_speed, "a number above 0 m/s");
  expect_not_negative(seconds(config.watchdog), "watchdog");
  if (config.admittance) admittance_.emplace(*config.admittance);
  if (config.rotation) {
    if (config.admittance) {
      throw std::invalid_argument("rotation: expected no admittance, which only supports the force on a point");
    }
    wrench_.emplace(wrench_config(config.limiter, *config.rotation));
  }
  if (config.grip) grip_.emplace(grip_config(config.limiter, *config.grip));
  if (config.coupling) {
    if (config.coupling->grip && !config.grip) {
      throw std::invalid_argument("coupling.grip: expected a gripper with a motor, whose account the coupling shares");
    }
    couplings_.emplace(*config.coupling, config.leaders);
  }
  if (const auto& field = config.hold.field; field && !config.limiter.shared_account) {
    if (field->push.push_j > 0 || field->push.push_w > 0) {
      throw std::invalid_argument("field.push: expected a limiter with a shared_account, which the tank credits");
    }
  }
  if (config.friction_map) {
    if (!config.limiter.parts.adaptive_friction) {
      throw std::invalid_argument("friction_map: expected a limiter with adaptive_friction, which uses it");
    }
    friction_map_.emplace(*config.friction_map);
  }
}

void HapticController::book_unseen(const Vec3& applied, const HandleSample* handle, Duration held) noexcept {
  const Duration at_most = config_.watchdog > Duration::zero() ? std::min(held, config_.watchdog) : held;
  const bool whole = handle != nullptr;
  if (wrench_) {
    wrench_->observe_unseen(wrench_of(applied, whole ? handle->torque : Vec3(Vec3::Zero())), at_most);
  } else {
    limiter_.observe_unseen(applied, at_most);
  }
  if (grip_) grip_->observe_unseen(Vec<1>(whole ? handle->grip_force : 0), at_most);
  if (admittance_) admittance_->observe_unseen();
}

// The functions of every step are inlined. If a device only has a position, the cost of the other parts is one branch.
[[gnu::always_inline]] inline void HapticController::book_seen(const Motion& hand, const Vec3& applied,
                                                               const HandleSample* handle, Step& step) noexcept {
  const Vec3 dx = hand.position - last_->position;
  if (wrench_) {
    const std::uint64_t broken = wrench_->broken_assumptions();
    const Vec3 turn = turn_between(*last_orientation_, handle->turning->orientation);
    wrench_->observe({.applied = wrench_of(applied, handle->torque), .dx = wrench_of(dx, turn), .held = step.held});
    if (wrench_->broken_assumptions() != broken) step.reasons |= Reason::kAcceleration;
  } else {
    const Interval<3> interval{.applied = applied, .dx = dx, .held = step.held};
    const std::uint64_t broken = limiter_.broken_assumptions();
    limiter_.observe(interval);
    if (limiter_.broken_assumptions() != broken) step.reasons |= Reason::kAcceleration;
    if (admittance_) admittance_->observe(interval);
  }
  if (grip_) {
    const double travel = config_.grip->arm * (handle->grip->opening - *last_opening_);
    grip_->observe({.applied = Vec<1>(handle->grip_force), .dx = Vec<1>(travel), .held = step.held});
  }
}

void HapticController::add_accounts(Step& step) const noexcept {
  step.energy = wrench_ ? wrench_->energy() : limiter_.energy();
  step.longest_hold = wrench_ ? wrench_->longest_hold() : limiter_.longest_hold();
  if (grip_ && step.grip()) step.grip()->energy = grip_->energy();
}

[[gnu::always_inline]] inline void HapticController::book(const Motion& hand, const Vec3& applied,
                                                          const HandleSample* handle, Step& step) noexcept {
  step.held = started_ ? hand.at - last_at_ : Duration::zero();
  step.was_applied = applied;
  if (step.held > config_.limiter.longest_hold) step.reasons |= Reason::kOverrun;
  if (config_.watchdog > Duration::zero() && step.held > config_.watchdog) {
    step.reasons |= Reason::kWatchdog;
    book_unseen(applied, handle, step.held);
  } else if (last_) {
    book_seen(hand, applied, handle, step);
  } else if (started_) {
    // The previous position is unknown, and the device may still apply a force if the command was zero.
    book_unseen(applied, handle, step.held);
  }
  add_accounts(step);
}

void HapticController::follow_tool(Step& step) noexcept {
  const Vec3 unknown = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  step.force = admittance_
                   ->command({.hand_force = step.hand_force.value_or(unknown),
                              .environment = step.force,
                              .velocity = step.hand.velocity})
                   .force;
  if (!step.force.allFinite()) {
    step.force.setZero();
    step.reasons |= Reason::kNotFinite;
  }
}

/// The orientation and the opening are required in every sample if there are motors for them.
bool HapticController::is_finite(const Motion& hand, const HandleSample* handle) const noexcept {
  if (!hand.position.allFinite()) return false;
  if (handle == nullptr) return !wrench_ && !grip_;
  if (handle->turning ? !is_rotation(handle->turning->orientation) : wrench_.has_value()) return false;
  return handle->grip ? std::isfinite(handle->grip->opening) : !grip_;
}

bool HapticController::believable(const Motion& hand, const HandleSample* handle) const noexcept {
  if (!is_finite(hand, handle)) return false;
  if (!config_.max_speed || !last_) return true;
  return (hand.position - last_->position).norm() <= *config_.max_speed * seconds(hand.at - last_->at);
}

Step HapticController::disbelieve(const Motion& hand, const Vec3& applied, const HandleSample* handle) noexcept {
  const bool finite = is_finite(hand, handle);
  fault_ = finite ? Fault::kPositionJumped : Fault::kPositionNotFinite;
  Step blind = step_unseen(hand.at, applied, handle);
  if (!finite) blind.reasons |= Reason::kNotFinite;
  return blind;
}

void HapticController::step_into(Step& fresh, const Motion& hand, const Vec3& applied,
                                 const std::optional<Vec3>& hand_force, const HandleSample* handle) noexcept {
  if (!believable(hand, handle)) {
    fresh = disbelieve(hand, applied, handle);
    return;
  }
  const Quat* const orientation = handle != nullptr && handle->turning ? &handle->turning->orientation : nullptr;
  ForceChannels::Wanted wanted = held_.wanted(hand, orientation);
  take(fresh, hand, applied, hand_force, wanted, handle);
  if (const auto& newest = held_.newest(wanted.channel)) {
    fresh.force_sequence = newest->sequence;
    fresh.loop_age = hand.at - newest->answers;
    fresh.force_error = newest->error;
    fresh.force_way = newest->way;
  }
}

Step HapticController::step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
                            const ForceChannels::Wanted& wanted, const HandleSample* handle,
                            const EnergyTank::Settlement& settled, const EnergyTank::Settlement& grip_settled,
                            const std::optional<FieldStep>& field) noexcept {
  if (!believable(hand, handle)) return disbelieve(hand, applied, handle);
  settled_ = settled;
  grip_settled_ = grip_settled;
  Step step;
  step.field = field;
  ForceChannels::Wanted given = wanted;
  take(step, hand, applied, hand_force, given, handle);
  return step;
}

void HapticController::add_coupling(const Motion& hand, const HandleSample* handle, Step& step,
                                    ForceChannels::Wanted& wanted) noexcept {
  if (started_) {
    const Vec3 dx = last_ ? Vec3(hand.position - last_->position) : Vec3(Vec3::Zero());
    double payable = std::numeric_limits<double>::infinity();
    if (config_.limiter.shared_account) payable = wrench_ ? wrench_->payable() : limiter_.payable();
    couplings_->observe({step.was_applied, dx, step.held}, payable);
  }
  const Demand<3> demand = couplings_->command(hand, buttons_, ready(), handle);
  if (wrench_) step.turn()->wanted += couplings_->torque();
  if (grip_) step.grip()->wanted += couplings_->grip_force();
  wanted.force += demand.force;
  wanted.stiffness += demand.stiffness;
  const bool silent = wanted.mode == Mode::kIdle || wanted.mode == Mode::kSafeStop;
  if (silent && couplings_->live()) wanted.mode = Mode::kActive;
}

/// This function is not inlined because most scenes do not have fields.
[[gnu::noinline]] void HapticController::render_fields(const Motion& hand, Step& step,
                                                       ForceChannels::Wanted& wanted) noexcept {
  ++tick_;
  if (const auto rendered = held_.render(hand, step.energy, tick_, wanted)) step.field = rendered;
}

/// Credits the energy from the tank of a field and from the peers, and withdraws the energy given to them, before the
/// account bounds the force. The peers cannot receive energy that is stored in a field.
template <class Port, class Force>
void HapticController::settle(Port& port, const Force& wanted, const Step& step) noexcept {
  double stored = 0;
  if (step.field) {
    port.credit(step.field->credit);
    stored = step.field->stored;
  }
  if (couplings_) settled_ = couplings_->settle(port.payable() - stored, port.worst_loss(wanted), step.held);
  port.credit(settled_.credit);
  port.withdraw(settled_.withdraw);
}

void HapticController::settle_grip(double wanted, Duration elapsed) noexcept {
  if (couplings_) {
    grip_settled_ = couplings_->settle_grip(grip_->payable(), grip_->worst_loss(Vec<1>(wanted)), elapsed);
  }
  grip_->credit(grip_settled_.credit);
  grip_->withdraw(grip_settled_.withdraw);
}

/// Records the measurements of the handle and the demands of the remote environment.
void HapticController::note(const HandleSample& handle, const ForceChannels::Wanted& wanted, Step& step) noexcept {
  HandleStep& noted = step.handle.emplace();
  const HandleWanted asked = wanted.handle.value_or(HandleWanted{});
  if (handle.turning) noted.turn = {.hand = *handle.turning, .was_applied = handle.torque, .wanted = asked.torque};
  if (handle.grip) noted.grip = {.hand = *handle.grip, .was_applied = handle.grip_force, .wanted = asked.grip};
}

void HapticController::take(Step& step, const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
                            ForceChannels::Wanted& wanted, const HandleSample* handle) noexcept {
  step.hand = hand;
  step.hand_force = hand_force;
  if (handle != nullptr) note(*handle, wanted, step);
  book(hand, applied, handle, step);
  if (held_.has_fields()) render_fields(hand, step, wanted);
  if (couplings_) add_coupling(hand, handle, step, wanted);
  last_ = hand;
  if (wrench_) last_orientation_ = handle->turning->orientation;
  if (grip_) last_opening_ = handle->grip->opening;
  last_at_ = hand.at;
  started_ = true;
  missed_ = 0;

  step.wanted = wanted.force;
  step.stiffness = wanted.stiffness;
  step.mode = wanted.mode;
  step.reasons |= wanted.reasons;
  step.force_age = wanted.age;
  step.channel = static_cast<std::uint32_t>(wanted.channel);

  step.force = step.wanted;
  if (!step.force.allFinite()) {
    step.force.setZero();
    step.reasons |= Reason::kNotFinite;
  }
  if (admittance_) follow_tool(step);
  if (fault_ != Fault::kNone) {
    step.force.setZero();
    step.mode = Mode::kFault;
    step.reasons |= Reason::kFault;
  }
  if (disarmed_) step.force.setZero();
  if (wrench_) {
    limit_wrench(wanted.loop_age, applied, step);
  } else {
    limit_force(wanted, applied, step);
    // This device has no motor for rotation. If a device has no orientation, there is no demand for a torque.
    if (step.turn() && !step.turn()->wanted.isZero(0)) step.reasons |= Reason::kMaxForce;
  }
  if (grip_) limit_grip(step);
  if (disarmed_) {
    step.force.setZero();
    if (TurnStep* const turn = step.turn()) turn->torque.setZero();
    if (GripStep* const grip = step.grip()) grip->force = 0;
    step.reasons |= Reason::kDisarmed;
  }
}

[[gnu::always_inline]] inline void HapticController::limit_force(const ForceChannels::Wanted& wanted,
                                                                 const Vec3& applied, Step& step) noexcept {
  const Limited saturated = saturate(step.force, config_.max_force);
  // Even after a pause, the slew limit assumes at most one longest_hold.
  const Duration elapsed = std::min(step.held, config_.limiter.longest_hold);
  const Limited slewed = limit_slew(saturated.force, applied, config_.max_slew, elapsed);
  if (friction_map_) limiter_.adapt(friction_map_->at(step.hand.position));
  if (config_.limiter.shared_account) settle(limiter_, slewed.force, step);
  // A limit changes the felt environment, so the stiffness is only known for an unlimited force.
  const bool as_wanted =
      !admittance_ && !disarmed_ && saturated.reasons.empty() && slewed.reasons.empty() && step.mode == wanted.mode;
  const LimitedForce<3> limited = limiter_.limit(
      {.force = slewed.force, .stiffness = as_wanted ? wanted.stiffness : Mat3(Mat3::Zero()), .age = wanted.loop_age});
  step.force = limited.force;
  // The force may have been increased by the damper. It is safe to reduce it again.
  if (limited.reasons.has(Reason::kDamped)) step.force = saturate(step.force, config_.max_force).force;
  step.permitted = limited.permitted;
  step.reasons |= limited.reasons;
  // Only the tightest bound is a reason: if the limiter cut further, the bounds before it had no effect.
  if (!step.reasons.has(Reason::kEnergy)) {
    step.reasons |= saturated.reasons;
    step.reasons |= slewed.reasons;
  }
}

/// Similar to limit_force, but for both force and torque. The stiffness is not used by the laws of a wrench.
void HapticController::limit_wrench(Duration age, const Vec3& applied, Step& step) noexcept {
  const RotationLimits& rotation = *config_.rotation;
  TurnStep& turn = *step.turn();
  Vec3 torque = turn.wanted;
  if (fault_ != Fault::kNone || disarmed_ || !torque.allFinite()) {
    if (!torque.allFinite()) step.reasons |= Reason::kNotFinite;
    torque.setZero();
  }
  const LimitedWrench saturated = saturate(wrench_of(step.force, torque), config_.max_force, rotation.max_torque);
  const Duration elapsed = std::min(step.held, config_.limiter.longest_hold);
  const LimitedWrench slewed =
      limit_slew(saturated.wrench, wrench_of(applied, turn.was_applied), config_.max_slew, rotation.max_slew, elapsed);
  if (friction_map_) wrench_->adapt({friction_map_->at(step.hand.position), rotation.friction});
  if (config_.limiter.shared_account) settle(*wrench_, slewed.wrench, step);
  LimitedForce<6> limited = wrench_->limit({.force = slewed.wrench, .age = age});
  if (limited.reasons.has(Reason::kDamped)) {
    limited.force = saturate(limited.force, config_.max_force, rotation.max_torque).wrench;
  }
  step.force = limited.force.head<3>();
  turn.torque = limited.force.tail<3>();
  step.permitted = limited.permitted;
  step.reasons |= limited.reasons;
  if (!step.reasons.has(Reason::kEnergy)) {
    step.reasons |= saturated.reasons;
    step.reasons |= slewed.reasons;
  }
}

/// The limits of the gripper do not set reasons, which only describe the force.
void HapticController::limit_grip(Step& step) noexcept {
  const GripLimits& limits = *config_.grip;
  GripStep& grip = *step.grip();
  const bool none = fault_ != Fault::kNone || disarmed_ || !std::isfinite(grip.wanted);
  double force = none ? 0 : std::clamp(grip.wanted, -limits.max_force, limits.max_force);
  if (std::isfinite(limits.max_slew)) {
    const double most = limits.max_slew * seconds(std::min(step.held, config_.limiter.longest_hold));
    force = std::clamp(force, grip.was_applied - most, grip.was_applied + most);
  }
  if (config_.limiter.shared_account) settle_grip(force, step.held);
  const LimitedForce<1> limited = grip_->limit({.force = Vec<1>(force)});
  grip.force = limited.force[0];
  grip.permitted = limited.permitted;
}

Step HapticController::step_unseen(LocalTime now, const Vec3& applied, const HandleSample* handle) noexcept {
  Step step;
  step.hand = last_.value_or(Motion{});
  step.hand.at = now;
  step.was_applied = applied;
  if (handle != nullptr) {
    HandleSample known = *handle;
    if (wrench_ && !known.turning) known.turning = Turning{.orientation = last_orientation_.value_or(Quat{})};
    if (grip_ && !known.grip) known.grip = Grip{.opening = last_opening_.value_or(0)};
    note(known, {}, step);
  }
  if (started_) {
    step.held = now - last_at_;
    book_unseen(applied, handle, step.held);
  }
  last_.reset();
  last_at_ = now;
  started_ = true;
  ++tick_;
  if (++missed_ >= config_.max_missed && fault_ == Fault::kNone) fault_ = Fault::kDeviceSilent;
  if (couplings_) couplings_->command_unseen(now, ready());
  settled_ = {};
  grip_settled_ = {};

  add_accounts(step);
  step.permitted =
      wrench_ ? wrench_->limit({.force = Vec<6>::Zero()}).permitted : limiter_.limit({.force = Vec3::Zero()}).permitted;
  if (grip_) grip_->limit({.force = Vec<1>::Zero()});
  step.mode = fault_ == Fault::kNone ? Mode::kHolding : Mode::kFault;
  step.reasons |= Reason::kUnseen;
  if (fault_ != Fault::kNone) step.reasons |= Reason::kFault;
  if (disarmed_) step.reasons |= Reason::kDisarmed;
  return step;
}

void HapticController::rearm() noexcept {
  fault_ = Fault::kNone;
  disarmed_ = false;
  missed_ = 0;
  held_.disengage();
}

}  // namespace tendon
