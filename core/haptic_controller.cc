// SPDX-License-Identifier: Apache-2.0
#include "core/haptic_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/control/force_limits.h"

namespace tendon {

HapticController::HapticController(const Config& config)
    : config_(config), limiter_(config.limiter), held_({.hold = config.hold, .rules = config.channels}) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0))
      throw std::invalid_argument(std::string(name) + " must be above zero, got " + std::to_string(value));
  };
  positive(config.max_force, "max_force");
  positive(config.max_slew, "max_slew");
  if (!std::isfinite(config.max_force)) throw std::invalid_argument("max_force must be finite");
  if (config.max_speed) positive(*config.max_speed, "max_speed");
  if (config.watchdog < Duration::zero()) throw std::invalid_argument("watchdog must not be negative");
  if (config.admittance) admittance_.emplace(*config.admittance);
  if (config.friction_map) {
    if (!config.limiter.parts.adaptive_friction) {
      throw std::invalid_argument("friction_map is of use only to a limiter with adaptive_friction");
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
    limiter_.observe(interval);
    if (admittance_) admittance_->observe(interval);
  }
  step.energy = limiter_.energy();
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
  // After a pause the force may not have grown for as long as the pause lasted.
  const Duration elapsed = std::min(step.held, config_.limiter.longest_hold);
  const Limited slewed = limit_slew(saturated.force, applied, config_.max_slew, elapsed);
  if (friction_map_) limiter_.adapt(friction_map_->at(hand.position));
  // What bounds a force bends the environment: how it goes on from there is not known any more.
  const bool as_wanted =
      !admittance_ && !disarmed_ && saturated.reasons.empty() && slewed.reasons.empty() && step.mode == wanted.mode;
  const LimitedForce<3> limited =
      limiter_.limit({.force = slewed.force, .stiffness = as_wanted ? wanted.stiffness : Mat3(Mat3::Zero())});
  step.force = limited.force;
  step.permitted = limited.permitted;
  step.reasons |= limited.reasons;
  // The tightest bound is the reason: one that was met before the limiter cut further did not matter.
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
