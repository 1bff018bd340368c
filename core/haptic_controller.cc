// SPDX-License-Identifier: Apache-2.0
#include "core/haptic_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/force_limits.h"

namespace tendon {

namespace {

using Vec1 = Eigen::Matrix<double, 1, 1>;

}  // namespace

HapticController::HapticController(const Config& config)
    : config_(config),
      limiter_({config.friction, config.longest_hold}),
      ledger_(config.friction),
      axes_{ledger_, ledger_, ledger_},
      held_(config.hold) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0))
      throw std::invalid_argument(std::string(name) + " must be above zero, got " + std::to_string(value));
  };
  positive(config.max_force, "max_force");
  positive(config.max_slew, "max_slew");
  if (!std::isfinite(config.max_force)) throw std::invalid_argument("max_force must be finite");
  if (config.watchdog < Duration::zero()) throw std::invalid_argument("watchdog must not be negative");
}

double HapticController::energy() const noexcept {
  if (config_.limiter != Limiter::kPerAxis) return ledger_.energy();
  return axes_[0].energy() + axes_[1].energy() + axes_[2].energy();
}

double HapticController::least_energy() const noexcept {
  if (config_.limiter != Limiter::kPerAxis) return ledger_.energy();
  return std::min({axes_[0].energy(), axes_[1].energy(), axes_[2].energy()});
}

void HapticController::book_unseen(const Vec3& applied, Duration held) noexcept {
  const Duration at_most = config_.watchdog > Duration::zero() ? std::min(held, config_.watchdog) : held;
  if (config_.limiter == Limiter::kPerAxis) {
    for (int i = 0; i < 3; ++i) axes_[static_cast<std::size_t>(i)].observe_unseen(std::abs(applied[i]), at_most);
  } else {
    ledger_.observe_unseen(applied.norm(), at_most);
  }
}

void HapticController::book(const Motion& hand, const Vec3& applied, Step& step) noexcept {
  step.held = started_ ? hand.at - last_at_ : Duration::zero();
  step.was_applied = applied;
  if (step.held > config_.longest_hold) step.reasons |= Reason::kOverrun;
  if (config_.watchdog > Duration::zero() && step.held > config_.watchdog) {
    step.reasons |= Reason::kWatchdog;
    book_unseen(applied, step.held);
  } else if (last_) {
    const Vec3 dx = hand.position - last_->position;
    if (config_.limiter == Limiter::kPerAxis) {
      for (int i = 0; i < 3; ++i) {
        axes_[static_cast<std::size_t>(i)].observe(Vec1(applied[i]), Vec1(dx[i]), step.held);
      }
    } else {
      ledger_.observe(applied, dx, step.held);
    }
  }
  step.energy = energy();
}

void HapticController::limit(Step& step) const noexcept {
  switch (config_.limiter) {
    case Limiter::kNone:
      step.permitted = std::numeric_limits<double>::infinity();
      return;
    case Limiter::kJoint: {
      const auto limited = limiter_.limit(step.force, ledger_.energy());
      step.force = limited.force;
      step.permitted = limited.permitted;
      step.reasons |= limited.reasons;
      return;
    }
    case Limiter::kPerAxis:
      step.permitted = 0;
      for (int i = 0; i < 3; ++i) {
        const auto limited = limiter_.limit(Vec1(step.force[i]), axes_[static_cast<std::size_t>(i)].energy());
        step.force[i] = limited.force[0];
        step.permitted = std::max(step.permitted, limited.permitted);
        step.reasons |= limited.reasons;
      }
      return;
  }
}

Step HapticController::step(const Motion& hand, const Vec3& applied) noexcept {
  if (!hand.position.allFinite()) {
    fault_ = Fault::kPositionNotFinite;
    Step blind = step_unseen(hand.at, applied);
    blind.reasons |= Reason::kNotFinite;
    return blind;
  }

  Step step;
  step.hand = hand;
  book(hand, applied, step);
  last_ = hand;
  last_at_ = hand.at;
  started_ = true;
  missed_ = 0;

  const HeldForce::Wanted wanted = held_.wanted(hand);
  step.wanted = wanted.force;
  step.mode = wanted.mode;
  step.reasons |= wanted.reasons;
  step.force_age = wanted.age;
  if (const auto& newest = held_.newest()) {
    step.force_sequence = newest->sequence;
    step.loop_age = hand.at - newest->answers;
  }

  step.force = step.wanted;
  if (!step.force.allFinite()) {
    step.force.setZero();
    step.reasons |= Reason::kNotFinite;
  }
  if (fault_ != Fault::kNone) {
    step.force.setZero();
    step.mode = Mode::kFault;
    step.reasons |= Reason::kFault;
  }
  const Limited saturated = saturate(step.force, config_.max_force);
  // After a pause the force may not have grown for as long as the pause lasted.
  const Duration elapsed = std::min(step.held, config_.longest_hold);
  const Limited slewed = limit_slew(saturated.force, applied, config_.max_slew, elapsed);
  step.force = slewed.force;
  limit(step);
  // The tightest bound is the reason: one that was met before the limiter cut further did not matter.
  if (!step.reasons.has(Reason::kEnergy)) {
    step.reasons |= saturated.reasons;
    step.reasons |= slewed.reasons;
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

  step.energy = energy();
  step.permitted =
      config_.limiter == Limiter::kNone ? std::numeric_limits<double>::infinity() : limiter_.permitted(least_energy());
  step.mode = fault_ == Fault::kNone ? Mode::kHolding : Mode::kFault;
  step.reasons |= Reason::kUnseen;
  if (fault_ != Fault::kNone) step.reasons |= Reason::kFault;
  return step;
}

void HapticController::rearm() noexcept {
  fault_ = Fault::kNone;
  missed_ = 0;
  held_.disengage();
}

}  // namespace tendon
