// SPDX-License-Identifier: Apache-2.0
#include "core/remote/held_force.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/base/portable_math.h"
#include "core/remote/answer.h"

namespace tendon {

HeldForce::HeldForce(const Config& config) : config_(config) {
  expect_not_negative(seconds(config.hold), "hold");
  expect_above_zero(seconds(config.decay), "decay");
  expect(config.safe_stop >= config.hold, "safe_stop", seconds(config.safe_stop),
         "hold of " + shortest(seconds(config.hold)) + " s or more");
  expect_not_negative(seconds(config.ramp_in), "ramp_in");
  expect_above_zero(seconds(config.max_valid_for), "max_valid_for");
  expect(config.max_stiffness > 0, "max_stiffness", config.max_stiffness, "a number above 0 N/m");
  expect(config.max_angular_stiffness > 0, "max_angular_stiffness", config.max_angular_stiffness,
         "a number above 0 N·m/rad");
  if (config.adaptive_local_model.has_value() + config.output_estimator.has_value() + config.learned_model.has_value() +
          config.field.has_value() >
      1) {
    throw std::invalid_argument(
        "adaptive_local_model, output_estimator, learned_model and field: expected at most one of them");
  }
  if (config.adaptive_local_model) local_model_.emplace(*config.adaptive_local_model);
  if (config.output_estimator) estimator_ = std::make_unique<OutputEstimator>(*config.output_estimator);
  if (config.learned_model) learned_ = std::make_unique<LearnedModel>(*config.learned_model);
  if (config.field) renderer_ = std::make_unique<field::Renderer>(*config.field);
}

bool HeldForce::observe(const RemoteForce& force) noexcept {
  if (!is_sound(force)) return false;
  if (force.field != 0) {
    return force.field == generation_ && force.source == source_ &&
           renderer_->observe(force.answers_tick, force.force, force.received);
  }
  if (generation_ != 0) return true;
  const bool anew = mode_ == Mode::kIdle || mode_ == Mode::kSafeStop || newest_->source != force.source || left_field_;
  left_field_ = false;
  if (anew || mode_ == Mode::kDecaying) {
    engaged_ = force.received;
    from_ = rendered_;
    handle_from_ = handle_rendered_;
    const double lost = anew ? 1.0 : 1 - presence_;
    ramp_ = Duration(static_cast<Duration::rep>(lost * static_cast<double>(config_.ramp_in.count())));
  }
  if (anew && local_model_) local_model_.emplace(*config_.adaptive_local_model);  // no blend from another source
  if (learned_ && (anew || force.topology_changed)) learned_->forget();
  newest_ = believed(force, config_.max_stiffness);
  if (newest_->torque) {
    if (newest_->topology_changed) newest_->torque->model.reset();
    newest_->torque = believed(*newest_->torque, config_.max_angular_stiffness);
  }
  if (local_model_) local_model_->observe(*newest_);
  if (estimator_) estimator_->correct(*newest_);
  if (learned_) learned_->correct(*newest_);
  mode_ = Mode::kActive;
  return true;
}

void HeldForce::release(std::uint32_t source, LocalTime now) noexcept {
  if (newest_ && newest_->source == source) newest_->valid_for = std::min(newest_->valid_for, now - newest_->received);
  if (generation_ != 0 && source_ == source) leave_field(now);
}

bool HeldForce::use(const FieldUse& use, LocalTime now) noexcept {
  if (!renderer_) return false;
  const bool mine = generation_ != 0 && source_ == use.source;
  if (use.field == nullptr) {
    if (mine) leave_field(now);
    return true;
  }
  if (use.generation == 0) return false;
  if (!mine) {
    if (generation_ != 0) renderer_->use(nullptr, now);
    engaged_ = now;
    ramp_ = config_.ramp_in;
    from_ = rendered_;
    handle_from_ = handle_rendered_;
    newest_.reset();
    mode_ = Mode::kIdle;
  }
  renderer_->use(use.field, now);
  generation_ = use.generation;
  source_ = use.source;
  return true;
}

void HeldForce::leave_field(LocalTime now) noexcept {
  renderer_->use(nullptr, now);
  generation_ = 0;
  newest_.emplace();
  newest_->answers = now;
  newest_->received = now;
  newest_->force = rendered_;
  newest_->source = source_;
  if (handle_rendered_) {
    newest_->torque = RemoteTorque{.torque = handle_rendered_->torque};
    newest_->grip_force = handle_rendered_->grip;
  }
  mode_ = Mode::kActive;
  ramp_ = Duration::zero();
  left_field_ = true;
}

void HeldForce::disengage() noexcept {
  newest_.reset();
  mode_ = Mode::kIdle;
  rendered_.setZero();
  handle_rendered_.reset();
  if (generation_ == 0) return;
  renderer_->restart();
  ramp_ = Duration::zero();
  handle_from_.reset();
}

HeldForce::Wanted HeldForce::beside_field(const Motion& hand) noexcept {
  Wanted result;
  result.mode = Mode::kActive;
  const Duration since_engaged = std::max(Duration::zero(), hand.at - engaged_);
  if (since_engaged < ramp_) {
    const double rest = 1 - seconds(since_engaged) / seconds(ramp_);
    result.reasons = Reason::kRampIn;
    result.force = from_ * rest;
    if (handle_from_) result.handle = {handle_from_->torque * rest, handle_from_->grip * rest};
  }
  rendered_ = result.force;
  handle_rendered_ = result.handle;
  return result;
}

field::Renderer::Rendered HeldForce::render(const Motion& hand, double account, std::uint64_t tick) noexcept {
  field::Renderer::Rendered rendered = renderer_->render(hand, account, tick);
  rendered_ += rendered.force;
  return rendered;
}

Duration HeldForce::validity() const noexcept { return std::min(newest_->valid_for, config_.max_valid_for); }

Prediction HeldForce::follow(const Motion& hand) noexcept {
  if (local_model_) {
    if (const auto blended = local_model_->predict(hand)) return *blended;
  }
  if (learned_ && !newest_->model) {
    if (const auto led = learned_->predict()) return *led;
  }
  if (!estimator_) return reconstruct(*newest_, hand.position);
  return estimator_->predict(hand).value_or(Prediction{.force = newest_->force, .stiffness = Mat3::Zero()});
}

std::optional<HandleWanted> HeldForce::handle_wanted(const Quat* orientation, double gain, double rest) const noexcept {
  HandleWanted result;
  if (handle_from_) result = {handle_from_->torque * rest, handle_from_->grip * rest};
  if (newest_->torque) {
    const RemoteTorque& torque = *newest_->torque;
    result.torque += gain * (orientation != nullptr ? reconstruct(torque, *orientation) : torque.torque);
  }
  result.grip += gain * newest_->grip_force.value_or(0);
  return result;
}

HeldForce::Wanted HeldForce::wanted(const Motion& hand, const Quat* orientation) noexcept {
  if (estimator_) estimator_->observe(hand);
  if (learned_) learned_->observe(hand);
  if (!newest_) return generation_ != 0 ? beside_field(hand) : Wanted{};
  Wanted result;
  // A force can arrive after the sample of this step. The wire format has no negative ages.
  result.age = std::max(Duration::zero(), hand.at - newest_->received);
  result.loop_age = std::max(Duration::zero(), hand.at - newest_->answers);
  const Duration overdue = result.age - validity();
  // Only `observe` may end a safe stop, even if the clock goes back.
  if (mode_ == Mode::kSafeStop || overdue >= config_.safe_stop) {
    mode_ = Mode::kSafeStop;
    rendered_.setZero();
    handle_rendered_.reset();
    result.mode = mode_;
    result.reasons = Reason::kSafeStop;
    return result;
  }

  double gain = 1;
  if (overdue <= Duration::zero()) {
    mode_ = Mode::kActive;
  } else if (overdue <= config_.hold) {
    mode_ = Mode::kHolding;
    result.reasons |= Reason::kHeld;
  } else {
    mode_ = Mode::kDecaying;
    result.reasons |= Reason::kDecaying;
    gain = portable::exp(-seconds(overdue - config_.hold) / seconds(config_.decay));
  }
  const Duration since_engaged = std::max(Duration::zero(), hand.at - engaged_);
  double rest = 0;  // share of the force at the start of the ramp
  if (since_engaged < ramp_) {
    result.reasons |= Reason::kRampIn;
    const double ramp = seconds(since_engaged) / seconds(ramp_);
    rest = gain * (1 - ramp);
    gain *= ramp;
  }

  presence_ = gain;

  result.mode = mode_;
  const Prediction environment = follow(hand);
  result.force = environment.force * gain + from_ * rest;
  result.stiffness = environment.stiffness * gain;
  rendered_ = result.force;
  if (newest_->torque || newest_->grip_force || handle_rendered_) {
    if (rest == 0) handle_from_.reset();
    result.handle = handle_wanted(orientation, gain, rest);
    handle_rendered_ = result.handle;
  }
  return result;
}

}  // namespace tendon
