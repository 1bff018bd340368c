// SPDX-License-Identifier: Apache-2.0
#include "server/haptic_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "devices/safety/safe_device.h"
#include "devices/simulated/simulated_device.h"

namespace tendon::haptic_loop_test {
namespace {

using std::chrono::milliseconds;

class Handle final : public Device {
 public:
  bool plugged = true;
  std::uint32_t buttons = 0;

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return plugged ? State::kHomed : State::kAbsent; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    if (!plugged) return std::nullopt;
    return PositionSample{.at = now, .position = Vec3::Zero(), .hand_force = std::nullopt, .buttons = buttons};
  }
  Vec3 apply(const Vec3& force) noexcept override { return plugged ? force : Vec3(Vec3::Zero()); }

 private:
  DeviceInfo info_{.name = "handle", .max_force = 8};
};

struct Pushed {
  explicit Pushed(Device& device) : loop(config(), device, *mail) {}

  static HapticLoop::Config config() {
    HapticLoop::Config config;
    config.control.limiter.law = Law::kNone;
    config.control.limiter.longest_hold = milliseconds(2);
    config.control.max_force = 8;
    config.control.max_slew = 100;
    return config;
  }
  void push() {
    RemoteForce force;
    force.sequence = ++sequence;
    force.source = source;
    force.received = force.answers = now;
    force.force = Vec3(-2, 0, 0);
    force.valid_for = valid_for;
    force.error = error;
    force.way = way;
    mail->forces[0].put(force);
  }
  StepRecord steps(int count, bool pushes = true) {
    StepRecord last;
    for (int i = 0; i < count; ++i) {
      if (pushes) push();
      now = loop.step(now);
      while (const StepRecord* step = mail->steps.front()) {
        last = *step;
        mail->steps.pop();
      }
    }
    return last;
  }
  void order(HapticOrder::Kind kind) { ASSERT_TRUE(mail->orders.try_push({.kind = kind})); }

  std::unique_ptr<Mailboxes> mail = std::make_unique<Mailboxes>();
  HapticLoop loop;
  LocalTime now{milliseconds(1)};
  std::uint64_t sequence = 0;
  std::uint32_t source = 0;
  Duration valid_for = milliseconds(20);
  std::optional<double> error{};  ///< reported by the engine together with `way`
  std::uint8_t way = 0;
};

SafeDevice::Config armed_at_start() {
  SafeDevice::Config safety;
  safety.arming.by = SafeDevice::Arming::By::kStart;
  return safety;
}

using Kind = HapticOrder::Kind;

TEST(HapticLoop, TheRecordHasTheErrorAndTheWayOfTheForceInUse) {
  Handle handle;
  Pushed pushed(handle);
  pushed.error = 0.25;
  pushed.way = 3;
  const StepRecord said = pushed.steps(3);
  EXPECT_EQ(said.force_error, 0.25);
  EXPECT_EQ(said.force_way, 3);
  pushed.error.reset();
  pushed.way = 0;
  const StepRecord unsaid = pushed.steps(2);
  EXPECT_FALSE(unsaid.force_error.has_value());
  EXPECT_EQ(unsaid.force_way, 0);
}

TEST(HapticLoop, TheButtonsAreInTheRecordAndTheStateOfTheirStep) {
  Handle handle;
  Pushed pushed(handle);
  handle.buttons = 0b101;
  EXPECT_EQ(pushed.steps(3).buttons, 0b101U);
  EXPECT_EQ(pushed.mail->state.take()->buttons, 0b101U);
  handle.plugged = false;
  EXPECT_EQ(pushed.steps(1).buttons, 0b101U) << "as it last said";
  handle.plugged = true;
  handle.buttons = 0;
  EXPECT_EQ(pushed.steps(1).buttons, 0U);
}

SimulatedDevice::Config circling(bool jointed) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.max_force = 8;
  config.start_velocity = {0.05, 0.02, 0};
  if (jointed) config.joint_friction = {.mechanism = Mechanism::Falcon{}, .coulomb = Vec3::Constant(1e-4)};
  return config;
}

TEST(HapticLoop, JointsAreInTheRecordAndTheStateAndChangeNothingElse) {
  SimulatedDevice plain(circling(true));
  const Mechanism mechanism(Mechanism::Falcon{});
  SafeDevice safe(armed_at_start(), plain);
  Pushed world(safe);
  for (int i = 0; i < 50; ++i) {
    const StepRecord record = world.steps(1);
    ASSERT_NE(record.joints(), nullptr);
    EXPECT_FALSE(record.turn() || record.grip());
    const Vec3 angles = mechanism.angles(record.hand.position);
    const Vec3 speeds = mechanism.jacobian(record.hand.position) * record.hand.velocity;
    EXPECT_EQ(*record.joints(), Joints::three(angles, speeds));
    EXPECT_EQ(world.mail->state.take()->joints, *record.joints());
  }
  SimulatedDevice none(circling(false));
  Pushed other(none);
  EXPECT_EQ(other.steps(3).joints(), nullptr);
  EXPECT_EQ(other.mail->state.take()->joints, std::nullopt);
}

TEST(HapticLoop, WithoutARecordingNoStepWaitsForTheLogAndAllAreCounted) {
  Handle handle;
  HapticLoop::Config config = Pushed::config();
  config.record = false;
  const auto mail = std::make_unique<Mailboxes>(Mailboxes::Capacities::unrecorded(config.period));
  HapticLoop loop(config, handle, *mail);
  LocalTime now{milliseconds(1)};
  for (int i = 0; i < 100; ++i) now = loop.step(now);
  EXPECT_EQ(mail->steps.front(), nullptr);
  EXPECT_EQ(mail->steps_lost, 0U);
  EXPECT_EQ(loop.health().steps, 100U);
  mail->flight.freeze();
  EXPECT_EQ(mail->flight.size(), 100U) << "the steps before a fault are kept all the same";
}

TEST(HapticLoop, EachNewSettingOfAnOutputIsCarriedOutOnce) {
  SimulatedDevice::Config config = circling(false);
  config.outputs = {{.name = "ring", .kind = OutputKind::kLamp}, {.name = "tip", .kind = OutputKind::kVibration}};
  SimulatedDevice plain(config);
  SafeDevice safe({}, plain);
  Pushed world(safe);
  const Vibration pulse{.amplitude = 1, .frequency = 0, .duration = milliseconds(5)};
  OutputSettings settings;
  settings.of[0] = {.number = 1, .setting = LampColour{0xFF}};
  settings.of[1] = {.number = 1, .setting = pulse};
  world.mail->outputs.put(settings);
  world.steps(1);
  EXPECT_EQ(plain.outputs().colour(0), 0xFFU);
  EXPECT_EQ(plain.outputs().amplitude(world.now, 1), 1);
  world.steps(10);
  settings.of[0] = {.number = 2, .setting = LampColour{}};
  world.mail->outputs.put(settings);
  world.steps(1);
  EXPECT_EQ(plain.outputs().colour(0), 0U);
  EXPECT_EQ(plain.outputs().amplitude(world.now, 1), 0) << "a pulse is not begun again by the setting of a lamp";
  settings.of[1].number = 2;
  world.mail->outputs.put(settings);
  world.steps(1);
  EXPECT_EQ(plain.outputs().amplitude(world.now, 1), 1) << "the same pulse, asked for again";
}

TEST(HapticLoop, ASafetyFaultFreezesTheFlightRecorderAtItsStep) {
  Handle handle;
  SafeDevice safe(armed_at_start(), handle);
  Pushed world(safe);
  world.steps(400);  // end of the ramp
  ASSERT_EQ(safe.status().state, SafetyState::kArmed);
  EXPECT_FALSE(world.mail->flight.frozen());
  handle.plugged = false;
  world.steps(5);
  EXPECT_EQ(world.loop.stats().fault, HapticController::Fault::kNone) << "5 steps are none of the controller's";
  ASSERT_TRUE(world.mail->flight.frozen());
  ASSERT_EQ(world.mail->flight.size(), 401U);
  EXPECT_EQ(world.mail->flight[399].applied, Vec3(-2, 0, 0));
  EXPECT_EQ(world.mail->flight[400].applied, Vec3(0, 0, 0));

  world.mail->flight.thaw();
  world.steps(5);
  EXPECT_FALSE(world.mail->flight.frozen());
}

TEST(HapticLoop, ADisarmedDeviceIsHomedAtOnceAndArmedAgainByAnOrderOnly) {
  Handle handle;
  SafeDevice safe(armed_at_start(), handle);
  Pushed world(safe);
  ASSERT_EQ(world.steps(400).applied, Vec3(-2, 0, 0));
  world.order(Kind::kDisarm);
  const StepRecord next = world.steps(1);
  EXPECT_EQ(next.applied, Vec3::Zero());
  EXPECT_TRUE(next.reasons.has(Reason::kDisarmed));
  EXPECT_TRUE(next.disarmed);
  EXPECT_EQ(safe.status().state, SafetyState::kHomed);
  EXPECT_EQ(world.steps(3000).applied, Vec3::Zero());
  EXPECT_EQ(safe.status().state, SafetyState::kHomed);
  EXPECT_EQ(safe.status().faults, 0U);
  EXPECT_EQ(world.loop.stats().fault, HapticController::Fault::kNone);
  EXPECT_FALSE(world.mail->flight.frozen());
  world.order(Kind::kRearm);
  const StepRecord again = world.steps(400);
  EXPECT_EQ(again.applied, Vec3(-2, 0, 0));
  EXPECT_FALSE(again.disarmed);
  EXPECT_EQ(safe.status().state, SafetyState::kArmed);
}

TEST(HapticLoop, ADisarmedDeviceWithoutASafetyLayerGivesNoForceEither) {
  Handle handle;
  Pushed world(handle);
  ASSERT_EQ(world.steps(400).applied, Vec3(-2, 0, 0));
  world.order(Kind::kDisarm);
  EXPECT_EQ(world.steps(1).applied, Vec3::Zero());
  EXPECT_EQ(world.steps(1000).applied, Vec3::Zero());
  EXPECT_EQ(world.loop.stats().fault, HapticController::Fault::kNone);
  world.order(Kind::kRearm);
  EXPECT_EQ(world.steps(400).applied, Vec3(-2, 0, 0));
}

TEST(HapticLoop, WhatWasDisarmedBeforeItWasHomedGivesNoForceWhenItIs) {
  Handle handle;
  handle.plugged = false;
  Pushed world(handle);
  world.steps(100);
  world.order(Kind::kDisarm);
  world.steps(100);
  handle.plugged = true;
  EXPECT_EQ(world.steps(400).applied, Vec3::Zero());
  world.order(Kind::kRearm);
  EXPECT_EQ(world.steps(400).applied, Vec3(-2, 0, 0));
}

TEST(HapticLoop, OfTwoOrdersTheLaterOneCounts) {
  Handle handle;
  Pushed world(handle);
  world.order(Kind::kRearm);
  world.order(Kind::kDisarm);
  EXPECT_EQ(world.steps(400).applied, Vec3::Zero());
  world.order(Kind::kDisarm);
  world.order(Kind::kRearm);
  EXPECT_EQ(world.steps(400).applied, Vec3(-2, 0, 0));
}

/// The engine (number 7) applies a force of 2 N. It then sends its last force and its release in the same period.
Vec3 applied_after_release(bool again) {
  Handle handle;
  Pushed pushed(handle);
  pushed.source = 7;
  pushed.valid_for = milliseconds(500);
  pushed.steps(300);
  if (again) pushed.push();
  pushed.mail->orders.try_push({HapticOrder::Kind::kRelease, 0, 7});
  return pushed.steps(450, false).applied;
}

TEST(HapticLoop, AForceThatComesWithTheReleaseOfItsSourceIsNotFresh) {
  EXPECT_EQ(applied_after_release(false), Vec3(0, 0, 0)) << "held for a moment, faded, stopped";
  EXPECT_EQ(applied_after_release(true), Vec3(0, 0, 0)) << "and not valid for another 500 ms";
}

// The pose was sent by an engine that no longer holds the channel.
TEST(HapticLoop, APoseOfAnotherEngineDoesNotMoveAField) {
  field::Field ball;
  ball.primitives.push_back({.shape = field::Sphere{.centre = Vec3(0.03, 0, 0), .radius = 0.02}});
  for (const std::uint32_t source : {1U, 2U}) {
    Handle device;
    HapticLoop::Config config;
    config.control.limiter = {.law = Law::kAol, .friction = {0.3, 0.8}, .longest_hold = milliseconds(1)};
    config.control.limiter.shared_account = true;
    config.control.max_force = 8;
    config.control.hold.field = field::Renderer::Config{.push = {.push_j = 0.1, .push_w = 1}};
    const auto mail = std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .flight = 2, .fields = true});
    HapticLoop loop(config, device, *mail);
    LocalTime now(std::chrono::seconds(1));
    FieldBox& box = mail->fields->front();
    box.use.put({.use = {.field = &ball, .generation = 3, .source = 2}, .number = 1});
    box.pose.put({.pose = {.at = now, .pose = {.position = Vec3(-0.02, 0, 0)}}, .source = source});
    double depth = 0;
    for (int i = 0; i < 500; ++i) {
      now = loop.step(now);
      const StepRecord& step = *mail->steps.front();
      ASSERT_TRUE(step.field);
      depth = std::max(depth, step.field->depth);
      mail->steps.pop();
    }
    EXPECT_EQ(box.taken, 1U);
    EXPECT_EQ(depth > 1e-3, source == 2) << depth;
  }
}

}  // namespace
}  // namespace tendon::haptic_loop_test
