// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field_engine.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/rotation.h"
#include "core/control/preset.h"

namespace tendon::lab {
namespace {

using std::chrono::milliseconds;

constexpr double kFrom = 0.5;           // s, because the error is large at the first contact
constexpr double kLate = 3;             // s
constexpr double kMaxForce = 8.5;       // N
constexpr double kMaxStiffness = 2000;  // N/m

}  // namespace

HapticController::Config field_control(const FieldCase& of) {
  HapticController::Config config;
  config.limiter = {.law = of.method == FieldMethod::kHeld ? Law::kAol : Law::kAolPlus,
                    .friction = field::Body{}.friction,
                    .longest_hold = milliseconds(1)};
  config.max_force = kMaxForce;
  config.max_slew = std::numeric_limits<double>::infinity();
  if (of.method == FieldMethod::kHeld) return config;
  config.limiter.parts =
      preset_parts(Preset::kFeel, {config.limiter.friction, config.limiter.longest_hold, of.count}).parts;
  config.limiter.shared_account = of.push.push_j > 0 || of.push.push_w > 0;
  if (has_field(of)) config.hold.field = field::Renderer::Config{.max_stiffness = kMaxStiffness, .push = of.push};
  return config;
}

FieldAnswer FieldEngine::answer(double now, const FieldState& state) {
  constexpr int kRounds = 60;
  // The truth must be the force at the time of the state, because the field is compared with it in this step.
  const double then = of_.method == FieldMethod::kLearned ? state.sampled : now;
  FieldAnswer answer{.force = contact_.force(of_.scene->pose_at(then), state.hand, 1 / kFieldEngineHz, kRounds)};
  ForceTable table{.first = contact_.gap(), .step = 1e-3, .size = ForceTable::kMaxEntries};
  for (std::size_t i = 0; i < table.size; ++i) table.force[i] = contact_.force_at(static_cast<double>(i) * table.step);
  const double stiffness = std::max(table.force[1] - table.force[0], 0.0) / table.step;
  answer.model = {.at = state.hand,
                  .stiffness = stiffness * Mat3::Identity(),
                  .contact = Contact{.normal = contact_.normal(), .gap = contact_.gap(), .table = table}};
  answer.pose = pose_for(of_.ahead ? now + (now - state.sampled) : now);
  return answer;
}

field::TimedPose FieldEngine::pose_for(double t) const {
  constexpr double kHalf = 1e-3;
  field::TimedPose pose{.at = LocalTime(from_seconds(t)), .pose = of_.scene->pose_at(t)};
  if (!of_.ahead) return pose;
  const field::Pose before = of_.scene->pose_at(t - kHalf);
  const field::Pose after = of_.scene->pose_at(t + kHalf);
  pose.velocity = (after.position - before.position) / (2 * kHalf);
  pose.angular_velocity = turn_between(before.turn, after.turn) / (2 * kHalf);
  return pose;
}

void FieldScore::book(const Vec3& hand, const Vec3& force, const std::optional<FieldStep>& field) {
  constexpr double kHold = 1e-3;  // s
  const Friction friction = field::Body{}.friction;
  const Vec3 dx = hand - last_.value_or(hand);
  energy_ += -held_.dot(dx) + friction.coulomb * dx.norm() + friction.viscous * dx.squaredNorm() / kHold;
  run_.least_energy = std::min(run_.least_energy, energy_);
  if (field) energy_ += field->credit;
  last_ = hand;
  held_ = force;
}

void FieldScore::add(const Vec3& hand, const Vec3& force, const std::optional<FieldStep>& field) {
  const Vec3 before = held_;
  book(hand, force, field);
  if (field) {
    run_.tank += field->credit;
    if (field->refused > 1e-9) run_.bound += 1.0 / of_.milliseconds;
  }
  const double t = 1e-3 * static_cast<double>(step_);
  if (t > kFrom) {
    const Vec3& truth = truth_.at(step_);
    for (const bool late : {false, true}) {
      if (late && t < kLate) continue;
      wrong_[late ? 1 : 0] += (force - truth).squaredNorm();
      all_[late ? 1 : 0] += truth.squaredNorm();
    }
    run_.jump = std::max(run_.jump, (force - before).norm());
    run_.true_jump = std::max(run_.true_jump, (truth - truth_[step_ - 1]).norm());
  }
  run_.force.push_back(force);
  ++step_;
}

FieldRun FieldScore::result() const {
  FieldRun run = run_;
  run.error = std::sqrt(wrong_[0] / all_[0]);
  run.late_error = std::sqrt(wrong_[1] / all_[1]);
  return run;
}

}  // namespace tendon::lab
