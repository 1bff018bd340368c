// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "core/field/renderer.h"
#include "devices/safety/safe_device.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/clients/field_slots.h"
#include "server/haptic_loop.h"
#include "tests/realtime/heap_guard.h"

namespace tendon::heap_test {
namespace {

using std::chrono::milliseconds;

TEST(HeapGuard, SeesEveryKindOfHeapCall) {
  const HeapGuard guard;
  const auto one = std::make_unique<int>(1);
  EXPECT_EQ(guard.calls(), 1U);
  const std::string text(100, 'x');
  EXPECT_EQ(guard.calls(), 2U);
}

TEST(HeapGuard, SeesAlignedHeapCalls) {
  struct alignas(64) Wide {
    char bytes[64];
  };
  const HeapGuard guard;
  auto wide = std::make_unique<Wide>();
  EXPECT_EQ(guard.calls(), 1U) << "operator new with an alignment";
  wide.reset();
  EXPECT_EQ(guard.calls(), 2U) << "and its delete";
  void* block = std::aligned_alloc(64, 128);
  EXPECT_EQ(guard.calls(), 3U);
  std::free(block);
  ASSERT_EQ(posix_memalign(&block, 64, 100), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % 64, 0U);
  EXPECT_EQ(guard.calls(), 5U);
  std::free(block);
  EXPECT_EQ(posix_memalign(&block, 3, 100), EINVAL);
}

// Tests the device, the velocity estimator, the controller with all limiters active, mailboxes, faults and rearms. The
// recording ring is tested both full and not full.
TEST(HapticLoop, AMillionStepsMakeNoHeapCall) {
  SimulatedDevice::Config hand = find_device_profile("falcon")->device();
  hand.hand =
      OperatorHand::Config{.stiffness = 300,
                           .damping = 3,
                           .mass = 0.05,
                           .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.5})};
  SimulatedDevice device(hand);
  HapticLoop::Config config;
  config.control.limiter.friction = {0.3, 0.8};
  config.control.limiter.longest_hold = milliseconds(2);
  config.control.max_force = 8;
  config.control.max_slew = 1000;
  const auto mail = std::make_unique<Mailboxes>();
  HapticLoop loop(config, device, *mail);

  std::uint64_t calls = 0;
  std::uint64_t limited = 0;
  LocalTime now(std::chrono::seconds(1));
  for (std::uint64_t i = 1; i <= 1'000'000; ++i) {
    if (i % 10 == 0) {
      RemoteForce force;
      force.sequence = i;
      force.received = now;
      const DeviceState* state = mail->state.take();
      force.force = Vec3(state->position.x() > 0 ? -2000 * state->position.x() : 0, 0, 0);
      if (i % 20 == 0) force.model = LocalModel{state->position, Mat3(Vec3(2000, 0, 0).asDiagonal())};
      force.valid_for = milliseconds(i % 500'000 < 250'000 ? 30 : 1);
      mail->forces[0].put(force);
      if (i % 100'000 == 0) {
        mail->orders.try_push({i % 200'000 == 0 ? HapticOrder::Kind::kRearm : HapticOrder::Kind::kRelease});
      }
    }
    {
      const HeapGuard guard;
      now = loop.step(now);
      calls += guard.calls();
    }
    while (i > 500'000) {  // the log thread only runs in the second half, so the ring is full in the first half
      const StepRecord* step = mail->steps.front();
      if (step == nullptr) break;
      if (step->reasons.has(Reason::kEnergy)) ++limited;
      mail->steps.pop();
    }
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(limited, 500U);
}

// A field of bricks and a fixture on a moving object, with swaps, tables that learn, and a tank.
TEST(FieldRenderer, TenThousandStepsMakeNoHeapCall) {
  field::BrickField bricks;
  field::sample([](const Vec3& x) { return x.norm() - 0.03; }, Vec3::Constant(-0.04), Vec3::Constant(0.04), 2e-3,
                bricks);
  field::Field first{.bricks = &bricks, .materials = {{.stiffness = 600, .branch = 300, .friction = 0.3}}};
  first.fixtures = {{.kind = field::Fixture::Kind::kLine, .stiffness = 100}};
  first.materials[0].table = field::DepthTable::of(2e-3, std::vector{0.5, 0.2});
  field::Field second{.bricks = &bricks, .materials = {{.stiffness = 900}}};
  second.materials[0].table = field::DepthTable::of(1e-3, std::vector{0.3});
  const auto renderer = std::make_unique<field::Renderer>(
      field::Renderer::Config{.max_stiffness = 1500, .push = {.push_j = 0.01, .push_w = 0.1}});
  std::uint64_t calls = 0;
  int pressed = 0;
  for (int k = 0; k < 10'000; ++k) {
    const LocalTime now{milliseconds(k)};
    const double t = 1e-3 * k;
    const Vec3 x(0.01 * std::sin(3 * t), 0.01 * std::sin(2 * t), 0.029 + 0.003 * std::sin(5 * t));
    const HeapGuard guard;
    if (k % 1000 == 0) renderer->use(k % 2000 == 0 ? &first : &second, now);
    if (k % 16 == 0) renderer->observe({.at = now, .velocity = {0.01, 0, 0}});
    if (k % 16 == 8) renderer->observe(static_cast<std::uint64_t>(k) - 8, Vec3(0, 0, 1), now);
    const auto rendered = renderer->render({.at = now, .position = x}, 0.1, static_cast<std::uint64_t>(k));
    calls += guard.calls();
    if (rendered.depth > 0) ++pressed;
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(pressed, 3000);
}

// Two engines take turns: they post fields, move and swap them, send true forces, and leave.
TEST(HapticLoop, WithFieldsMakesNoHeapCall) {
  SimulatedDevice::Config hand = find_device_profile("falcon")->device();
  hand.hand = OperatorHand::Config{.stiffness = 300,
                                   .damping = 3,
                                   .mass = 0.05,
                                   .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 2})};
  SimulatedDevice device(hand);
  HapticLoop::Config config;
  config.control.limiter = {.law = Law::kAolPlus, .friction = {0.3, 0.8}, .longest_hold = milliseconds(2)};
  config.control.limiter.shared_account = true;
  config.control.max_force = 8;
  config.control.max_slew = 1000;
  config.control.hold.field = field::Renderer::Config{.push = {.push_j = 0.01, .push_w = 0.1}};
  const auto mail = std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .fields = true});
  HapticLoop loop(config, device, *mail);
  FieldSlots slots(mail->fields->front());
  const auto fill = [](field::BrickField& bricks) {
    field::sample([](const Vec3& x) { return 0.005 - x.x(); }, Vec3::Constant(-0.02), Vec3::Constant(0.02), 2e-3,
                  bricks);
  };
  std::uint64_t calls = 0;
  std::uint64_t touched = 0;
  std::uint32_t generation = 0;
  LocalTime now(std::chrono::seconds(1));
  for (std::uint64_t n = 1; n <= 20'000; ++n) {
    const auto source = static_cast<std::uint32_t>(1 + n / 2000 % 2);
    const auto step_of = [n](std::uint64_t period) { return n % period == 0; };
    if (step_of(50)) {
      const FieldName name{static_cast<std::byte>(n / 50 % 2)};
      slots.use({.materials = {{.stiffness = 300.0 + static_cast<double>(n % 400), .friction = 0.2}}}, name, fill,
                ++generation, source);
    }
    if (step_of(4))
      slots.move({.pose = {.at = now, .pose = {.position = Vec3(1e-6 * static_cast<double>(n % 999), 0, 0)}},
                  .source = source});
    if (step_of(1999)) mail->orders.try_push({.kind = HapticOrder::Kind::kRelease, .source = source});
    if (step_of(1499)) slots.stop();
    slots.turn(source);
    if (step_of(10)) {
      RemoteForce truth;
      truth.sequence = n;
      truth.answers_tick = n - 5;
      truth.received = now;
      truth.force = Vec3(-1, 0, 0);
      truth.field = generation;
      truth.source = source;
      mail->forces[0].put(truth);
    }
    {
      const HeapGuard guard;
      now = loop.step(now);
      calls += guard.calls();
    }
    while (const StepRecord* const step = mail->steps.front()) {
      touched += step->field && step->field->depth > 0 ? 1 : 0;
      mail->steps.pop();
    }
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(touched, 2000U);
}

// Four leaders engage, hold the clutch, stop sending, and change their shares.
TEST(HapticLoop, OfAFollowerWithFourLeadersMakesNoHeapCall) {
  SimulatedDevice device(find_device_profile("falcon")->device());
  HapticLoop::Config config;
  config.control.limiter = {.law = Law::kAolPlus, .friction = {0.05, 0.26}, .longest_hold = milliseconds(2)};
  config.control.limiter.shared_account = true;
  config.control.max_force = 8;
  config.control.max_slew = 1000;
  auto& coupling = config.control.coupling.emplace();
  coupling.role = PortRole::kFollower;
  coupling.spring = {.stiffness = 400, .own_damping = 4, .period = milliseconds(1)};
  coupling.tank.emplace();
  coupling.holds_place = true;
  for (std::uint32_t i = 0; i < 4; ++i) config.control.leaders.push_back({.channel = i, .share = 0.25});
  config.control.channels.assign(4, ChannelRule::kSum);
  const auto mail = std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .ports = 64});
  HapticLoop loop(config, device, *mail);
  std::uint64_t calls = 0;
  std::uint64_t engaged = 0;
  LocalTime now(std::chrono::seconds(1));
  for (std::uint64_t n = 1; n <= 20'000; ++n) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      if (n % 3000 > 2500 && i == n / 3000 % 4) continue;
      PortState peer;
      peer.epoch = 5 + i;
      peer.sequence = n;
      peer.answers_epoch = 1;
      peer.answers = n - 1;
      peer.time = milliseconds(n);
      peer.engagement = n / 1000 + (n % 1000 < 100 ? 0 : 1);
      peer.phase = n % 1000 < 100 ? PortPhase::kCoupled : n % 1000 < 800 ? PortPhase::kEngaged : PortPhase::kClutched;
      peer.position = Vec3(0.01 * std::sin(0.01 * static_cast<double>(n)), 0, 0);
      peer.need = 1e-3;
      peer.given = 1e-6 * static_cast<double>(n);
      mail->port_in[i].put({peer, now});
    }
    if (n % 700 == 0) {
      mail->orders.try_push({.kind = HapticOrder::Kind::kShare,
                             .coupling = static_cast<std::uint32_t>(n / 700 % 4),
                             .share = 0.1 * static_cast<double>(n % 11)});
    }
    {
      const HeapGuard guard;
      now = loop.step(now);
      calls += guard.calls();
    }
    while (mail->steps.front() != nullptr) mail->steps.pop();
    for (const PortRecord* port = mail->ports.front(); port != nullptr; port = mail->ports.front()) {
      if (port->sent.phase == PortPhase::kEngaged) ++engaged;
      mail->ports.pop();
    }
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(engaged, 20'000U);
}

// Tests all parts of the safety layer while it is armed, faulted and disarmed.
TEST(SafeDevice, MakesNoHeapCallWhateverHappens) {
  SimulatedDevice::Config still = find_device_profile("falcon")->device();
  still.hand = OperatorHand::Config{
      .stiffness = 300, .damping = 20, .mass = 0.05, .motion = ScriptedMotion(ScriptedMotion::Sine{})};
  SimulatedDevice device(still);
  SafeDevice::Config config;
  config.growth_limit = GrowthLimit::Config{.rate = 500};
  config.force_limit = ForceLimit::Config{.max = 4};
  config.heat_limit = HeatLimit::Config{.peak = 4, .continuous = 2, .time_constant = milliseconds(100)};
  config.workspace = Workspace::Config{.shape = Workspace::Sphere{.radius = 1e-3}, .margin = 1e-3};
  config.ramp_in = RampIn::Config{.time = milliseconds(10)};
  config.speed_trip = SpeedTrip::Config{.max = 1};
  config.step_bound = StepBound::Config{.max_speed = 10};
  config.command_watchdog = Watchdog::Config{.timeout = milliseconds(30), .ramp = milliseconds(10)};
  config.link_watchdog = config.command_watchdog;
  SafeDevice safe(config, device);
  LocalTime now{};
  const HeapGuard guard;
  for (int i = 0; i < 100'000; ++i) {
    now += milliseconds(i % 3000 == 0 ? 100 : 1);
    safe.read(now);
    if (i % 500 == 0) safe.arm();
    const double push = i % 500 < 200 ? 0 : 6 * std::sin(0.02 * i);
    safe.apply({i % 7000 == 6999 ? std::nan("") : push, 0, 0});
  }
  EXPECT_EQ(guard.calls(), 0U);
  EXPECT_GT(safe.status().faults, 20U);
  EXPECT_GT(safe.times_armed(), 20U);
}

// Tests all laws of the catalogue, all parts of AOL+, all ways to extrapolate between two forces, and fields.
TEST(HapticController, NoLawAndNoPartMakesAHeapCallInTheLoop) {
  field::Field ball{.primitives = {{.shape = field::Sphere{.radius = 0.014}}}, .materials = {{.stiffness = 900}}};
  ball.fixtures = {{.kind = field::Fixture::Kind::kLine, .stiffness = 100}};
  for (const LawInfo& law : laws()) {
    for (int between = 0; between < 5; ++between) {
      HapticController::Config config;
      config.limiter = {.law = law.law, .friction = {0.05, 0.26}, .longest_hold = milliseconds(1)};
      config.limiter.max_force = 3;
      config.limiter.environment_stiffness = 2000;
      config.limiter.parts = {.energy_cap = {{}},
                              .robust_ledger = {{.encoder_step = {30e-6}}},
                              .knee = {{}},
                              .bounded_acceleration = {{.most = {300}}},
                              .shaping = {{.stiffness = {1000}}},
                              .adaptive_friction = {{}},
                              .thrift = {{}},
                              .damper = {{.viscous = {24}, .contact = {0.1}}},
                              .fading_contact = {{}}};
      config.max_force = 8;
      config.max_slew = 1000;
      if (between == 1) config.hold.adaptive_local_model.emplace();
      if (between == 2) config.hold.output_estimator.emplace();
      if (between == 3) config.hold.learned_model.emplace();
      if (between == 4) config.hold.field.emplace();
      HapticController controller(config);
      Vec3 applied = Vec3::Zero();
      const HeapGuard guard;
      for (int n = 1; n <= 5000; ++n) {
        const LocalTime now{milliseconds(n)};
        const Vec3 x(0.015 * std::sin(0.01 * n), 0.001 * std::sin(0.07 * n), 0);
        if (n % 10 == 0) {
          RemoteForce force;
          force.sequence = static_cast<std::uint64_t>(n);
          force.answers = now - milliseconds(1);
          force.received = now;
          force.force = -2000 * x;
          if (n % 20 == 0) force.model = LocalModel{x, Mat3::Identity() * 2000};
          if (n % 40 == 0) {
            force.model->contact =
                Contact{.normal = -Vec3::UnitX(),
                        .gap = 0,
                        .table = ForceTable{.first = 0, .step = 0.01, .size = 3, .force = {0, 1, 4}}};
          }
          force.valid_for = milliseconds(30);
          controller.observe(force);
        }
        if (n % 500 == 0) controller.use({n % 1500 == 0 ? nullptr : &ball, static_cast<std::uint32_t>(n)}, now);
        if (n % 16 == 0) controller.observe(field::TimedPose{.at = now, .velocity = {0.01, 0, 0}});
        if (n % 16 == 8) {
          controller.observe({.answers_tick = static_cast<std::uint64_t>(n) - 8,
                              .received = now,
                              .force = -x,
                              .field = controller.field()});
        }
        const Step step = n % 777 == 0 ? controller.step_unseen(now, applied)
                                       : controller.step({.at = now, .position = x, .velocity = Vec3::Zero()}, applied);
        applied = step.force;
      }
      EXPECT_EQ(guard.calls(), 0U) << law.name << ", between " << between;
    }
  }
}

}  // namespace
}  // namespace tendon::heap_test
