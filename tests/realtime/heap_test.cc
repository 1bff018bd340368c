// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/haptic_loop.h"
#include "tests/realtime/heap_guard.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;

TEST(HeapGuard, SeesEveryKindOfHeapCall) {
  const HeapGuard guard;
  const auto one = std::make_unique<int>(1);
  EXPECT_EQ(guard.calls(), 1U);
  const std::string text(100, 'x');
  EXPECT_EQ(guard.calls(), 2U);
}

// The whole haptic thread: device, velocity, controller with every limiter at work, mail, recording ring full
// and not, faults and rearms.
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
      mail->force.put(force);
      if (i % 100'000 == 0) mail->orders.try_push(i % 200'000 == 0 ? HapticOrder::kRearm : HapticOrder::kRelease);
    }
    {
      const HeapGuard guard;
      now = loop.step(now);
      calls += guard.calls();
    }
    while (i > 500'000) {  // the log thread takes part only then: until there the ring is full
      const StepRecord* step = mail->steps.front();
      if (step == nullptr) break;
      if (step->reasons.has(Reason::kEnergy)) ++limited;
      mail->steps.pop();
    }
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(limited, 500U);
}

}  // namespace
}  // namespace tendon
