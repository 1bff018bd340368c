// SPDX-License-Identifier: Apache-2.0
// A hand that presses on uploaded fields, with a tank and a force on another channel. Its recording replays to the last
// bit.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/haptic_controller.h"
#include "server/recording/recording_codec.h"
#include "tests/tools/replay/rerun.h"

namespace tendon::replay::field_replay_test {
namespace {

using std::chrono::milliseconds;

HapticController::Config two_channels() {
  HapticController::Config config;
  config.limiter = {.law = Law::kAolPlus, .friction = {0.02, 0.26}, .longest_hold = milliseconds(2)};
  config.limiter.shared_account = true;
  config.max_force = 5;
  config.channels.assign(2, ChannelRule::kSum);
  config.hold.field = field::Renderer::Config{.push = {.push_j = 0.02, .push_w = 0.5}};
  return config;
}

/// Simulates 3 s with two fields, poses, true forces, a failed reading, a disarmed device, and an engine that
/// disconnects.
std::vector<StepRecord> lived(const HapticController::Config& config) {
  field::Field ball{.primitives = {{.shape = field::Sphere{.radius = 0.03}}}};
  ball.materials = {{.stiffness = 800, .branch = 300, .tau = 0.1, .friction = 0.3}};
  ball.materials[0].table = field::DepthTable::of(1e-3, std::vector{0.2, 0.5, 0.3});
  field::Field plane{.primitives = {{.shape = field::Plane{.at = {0, 0, 0.03}}}}};
  HapticController controller(config);
  std::vector<StepRecord> steps;
  SolverPaths ways;
  Vec3 applied = Vec3::Zero();
  for (std::uint64_t tick = 1; tick <= 3000; ++tick) {
    const LocalTime now{milliseconds(tick)};
    const double t = 1e-3 * static_cast<double>(tick);
    StepRecord record;
    if (tick == 100) controller.use({.field = &ball, .generation = 1}, now, 1);
    if (tick == 1200) controller.use({.field = &plane, .generation = 2}, now, 1);
    if (tick % 16 == 0) {
      controller.observe(field::TimedPose{.at = now, .pose = {.position = {0, 0, 0.004 * std::sin(9 * t)}}}, 1);
      controller.observe(
          {.answers_tick = tick - 16, .received = now, .force = {0, 0, 1}, .field = tick < 1200 ? 1U : 2U}, 1);
      controller.observe(
          {.sequence = tick, .received = now, .force = {0.3, 0, 0}, .valid_for = milliseconds(30), .source = 1}, 0);
    }
    if (tick == 2000) {
      controller.disarm();
      record.disarmed = true;
    }
    if (tick == 2100) {
      controller.rearm();
      record.rearmed = true;
    }
    if (tick == 2700) controller.release(now, 0, 1);
    const Vec3 x(0.01 * std::sin(3 * t), 0.01 * std::sin(2 * t), 0.029 + 0.003 * std::sin(5 * t));
    static_cast<Step&>(record) =
        tick == 1700 ? controller.step_unseen(now, applied) : controller.step({.at = now, .position = x}, applied);
    applied = record.force;
    record.tick = tick;
    record.scheduled = now;
    record.applied = applied;
    steps.push_back(recording::decode_step(recording::encode(record), now, ways));
  }
  return steps;
}

TEST(FieldReplay, StepsWithFieldsAreTakenAgainToTheLastBit) {
  const HapticController::Config config = two_channels();
  const std::vector<StepRecord> steps = lived(config);
  Rerun rerun(config, Rerun::Held::kRecorded);
  int limited = 0;
  double credit = 0;
  for (const StepRecord& step : steps) {
    ASSERT_EQ(difference(step, rerun.step(step)), "") << "step " << step.tick;
    ASSERT_EQ(step.field.has_value(), step.tick >= 100 && step.tick < 2700 && step.tick != 1700) << step.tick;
    if (step.reasons.has(Reason::kEnergy)) ++limited;
    if (step.field) credit += step.field->credit;
  }
  EXPECT_GT(limited, 100);
  EXPECT_GT(credit, 1e-3);
}

TEST(FieldReplay, NoticesThatTheTankPaidMore) {
  const HapticController::Config config = two_channels();
  Rerun rerun(config, Rerun::Held::kRecorded);
  std::string how;
  for (StepRecord step : lived(config)) {
    if (step.field && step.field->credit > 0) step.field->credit *= 1.5;
    if (how = difference(step, rerun.step(step)); !how.empty()) break;
  }
  EXPECT_NE(how.find("permitted_n"), std::string::npos) << how;
}

TEST(FieldReplay, AnotherLawWithoutASharedAccountReplaysTheForces) {
  const HapticController::Config config = two_channels();
  HapticController::Config other = config;
  other.limiter.law = Law::kNone;
  other.limiter.shared_account = false;
  Rerun rerun(other, Rerun::Held::kOwn);
  for (const StepRecord& step : lived(config)) {
    const StepRecord again = rerun.step(step);
    if (!step.disarmed && again.reasons.empty()) {
      EXPECT_EQ(again.force, step.wanted) << step.tick;
    }
  }
}

}  // namespace
}  // namespace tendon::replay::field_replay_test
