// SPDX-License-Identifier: Apache-2.0
#include "core/haptic_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/control/force_limits.h"

namespace tendon {

HapticController::HapticController(const Config& config)
    : config_(config), limiter_(config.limiter), held_({.hold = config.hold, .rules = config.channels}) {
  expect_above_zero(config.max_force, "max_force");
  expect(config.max_slew > 0, "max_slew", config.max_slew, "a number above 0 N/s, or infinity");
  if (config.max_speed) expect(*config.max_speed > 0, "max_speed", *config.max_speed, "a number above 0 m/s");
  expect_not_negative(seconds(config.watchdog), "watchdog");
  if (config.admittance) admittance_.emplace(*config.admittance);
  if (config.friction_map) {
    if (!config.limiter.parts.adaptive_friction) {
      throw std::invalid_argument("friction_map: expected a limiter with adaptive_friction, which is the only user");
    }
    friction_map_.emplace(*config.friction_map);
  }
}

void HapticController::book_unseen(const Vec3& applied, Duration held) noexcept {
  const Duration at_most = config_.watchdog > Duration::zero() ? std::min(held, config_.watchdog) : held;
  limiter_.observe_unseen(applied, at_most);
  if (admittance_) admittance_->observe_unseen();
}

void HapticController::book(const Motion& hand, const Vec3& applied, Step& step) noexcept {
  step.held = started_ ? hand.at - last_at_ : Duration::zero();
  step.was_applied = applied;
  if (step.held > config_.limiter.longest_hold) step.reasons |= Reason::kOverrun;
  if (config_.watchdog > Duration::zero() && step.held > config_.watchdog) {
    step.reasons |= Reason::kWatchdog;
    book_unseen(applied, step.held);
  } else if (last_) {
    const Interval<3> interval{.applied = applied, .dx = hand.position - last_->position, .held = step.held};
    const std::uint64_t broken = limiter_.broken_assumptions();
    limiter_.observe(interval);
    step.assumption_broken = limiter_.broken_assumptions() != broken;
    if (admittance_) admittance_->observe(interval);
  } else if (started_) {
    // The position before was not seen, and the device may hold a force although it was told zero.
    book_unseen(applied, step.held);
  }
  step.energy = limiter_.energy();
  step.longest_hold = limiter_.longest_hold();
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

bool HapticController::believable(const Motion& hand) const noexcept {
  if (!hand.position.allFinite()) return false;
  if (!config_.max_speed || !last_) return true;
  return (hand.position - last_->position).norm() <= *config_.max_speed * seconds(hand.at - last_->at);
}

Step HapticController::disbelieve(const Motion& hand, const Vec3& applied) noexcept {
  const bool finite = hand.position.allFinite();
  fault_ = finite ? Fault::kPositionJumped : Fault::kPositionNotFinite;
  Step blind = step_unseen(hand.at, applied);
  if (!finite) blind.reasons |= Reason::kNotFinite;
  return blind;
}

Step HapticController::step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force) noexcept {
  if (!believable(hand)) return disbelieve(hand, applied);
  const ForceChannels::Wanted wanted = held_.wanted(hand);
  Step step = take(hand, applied, hand_force, wanted);
  if (const auto& newest = held_.newest(wanted.channel)) {
    step.force_sequence = newest->sequence;
    step.loop_age = hand.at - newest->answers;
    step.force_error = newest->error;
  }
  return step;
}

Step HapticController::step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
                            const ForceChannels::Wanted& wanted) noexcept {
  return believable(hand) ? take(hand, applied, hand_force, wanted) : disbelieve(hand, applied);
}

Step HapticController::take(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
                            const ForceChannels::Wanted& wanted) noexcept {
  Step step;
  step.hand = hand;
  step.hand_force = hand_force;
  book(hand, applied, step);
  last_ = hand;
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
  const Limited saturated = saturate(step.force, config_.max_force);
  // After a pause the force may grow by what one longest hold allows, not by what the whole pause would.
  const Duration elapsed = std::min(step.held, config_.limiter.longest_hold);
  const Limited slewed = limit_slew(saturated.force, applied, config_.max_slew, elapsed);
  if (friction_map_) limiter_.adapt(friction_map_->at(hand.position));
  // A limit changes the environment as the hand feels it, so its stiffness is known only for an unlimited force.
  const bool as_wanted =
      !admittance_ && !disarmed_ && saturated.reasons.empty() && slewed.reasons.empty() && step.mode == wanted.mode;
  const LimitedForce<3> limited =
      limiter_.limit({.force = slewed.force, .stiffness = as_wanted ? wanted.stiffness : Mat3(Mat3::Zero())});
  step.force = limited.force;
  step.permitted = limited.permitted;
  step.reasons |= limited.reasons;
  // Only the tightest bound is a reason: when the limiter cut further, the bounds before it made no difference.
  if (!step.reasons.has(Reason::kEnergy)) {
    step.reasons |= saturated.reasons;
    step.reasons |= slewed.reasons;
  }
  if (disarmed_) {
    step.force.setZero();
    step.reasons |= Reason::kDisarmed;
  }
  return step;
}

Step HapticController::step_unseen(LocalTime now, const Vec3& applied) noexcept {
  Step step;
  step.hand = last_.value_or(Motion{});
  step.hand.at = now;
  step.was_applied = applied;
  if (started_) {
    step.held = now - last_at_;
    book_unseen(applied, step.held);
  }
  last_.reset();
  last_at_ = now;
  started_ = true;
  if (++missed_ >= config_.max_missed && fault_ == Fault::kNone) fault_ = Fault::kDeviceSilent;

  step.energy = limiter_.energy();
  step.longest_hold = limiter_.longest_hold();
  step.permitted = limiter_.limit({.force = Vec3::Zero()}).permitted;
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
