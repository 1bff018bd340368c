// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tests/devices/woodenhaptics/woodenhaptics_bench.h"

namespace tendon::woodenhaptics_device_test {
namespace {

using State = Device::State;
using Fault = FakeWoodenHaptics::Fault;
using Bench = WoodenHapticsBench;
using namespace std::chrono_literals;

TEST(WoodenHapticsDevice, FromThePlugToTheForceItTakesEveryStep) {
  for (const auto& model : woodenhaptics::models()) {
    SCOPED_TRACE(model.name);
    Bench bench({.model = model.name});
    bench.arm.unplug();
    bench.run(100ms, kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    bench.arm.plug();
    EXPECT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
    EXPECT_TRUE(bench.reaches(State::kUnhomed, 100ms, kForce));
    bench.run(1s, kForce);
    EXPECT_EQ(bench.device.state(), State::kUnhomed);
    EXPECT_FALSE(bench.sample);
    EXPECT_FALSE(bench.arm.pushes());
    bench.home(kForce);
    EXPECT_EQ(bench.device.state(), State::kHomed);
    EXPECT_EQ(bench.arm.calibrations(), 1);
    EXPECT_EQ(bench.most_lawless, 0);
    bench.run(10ms, kForce);
    ASSERT_TRUE(bench.sample);
    EXPECT_LT(bench.sample->position.norm(), 2 * bench.device.info().position_resolution);
    EXPECT_TRUE(bench.arm.pushes());
    // This excludes errors of sign and scale. If there is one wrong count, the force is wrong by a few thousandths.
    EXPECT_LT((bench.arm.force() - bench.written).norm(), 0.01 * bench.written.norm());
    EXPECT_GT(bench.written.normalized().dot(kForce.normalized()), 0.999);
  }
}

TEST(WoodenHapticsDevice, SaysWhatItIsAndWhenItsFirmwareLetsGo) {
  const Bench bench;
  const DeviceInfo& info = bench.device.info();
  EXPECT_EQ(info.name, "woodenhaptics_v2019");
  EXPECT_EQ(info.max_force, 5);
  EXPECT_EQ(info.watchdog, 500ms);
  // 2π/2000, gear 12, lower link of 245 mm.
  EXPECT_NEAR(info.position_resolution, 2 * std::numbers::pi / 2000 / 12 * 0.245, 1e-9);
  EXPECT_GT(info.force_resolution, 16 * 0.321e-3 / 0.220) << "a mA of the motor of body A alone";
  EXPECT_LT(info.force_resolution, 0.05);
}

TEST(WoodenHapticsDevice, RefusesTooHighCurrentsAndAMissingModel) {
  LocalTime now{};
  FakeWoodenHaptics arm({});
  const auto refuses = [&](const WoodenHapticsDevice::Config& config) {
    EXPECT_THROW(WoodenHapticsDevice(config, std::make_unique<ModelPipe<FakeWoodenHaptics>>(arm, now)),
                 std::invalid_argument);
  };
  const auto* v2019 = woodenhaptics::find_model("woodenhaptics_v2019");
  refuses({});
  refuses({.model = v2019, .max_current = 0});
  refuses({.model = v2019, .max_current = kNan});
  refuses({.model = v2019, .max_current = 3.1});
  WoodenHapticsDevice({.model = woodenhaptics::find_model("woodenhaptics_v2015"), .max_current = 6},
                      std::make_unique<ModelPipe<FakeWoodenHaptics>>(arm, now));
}

// During its LED test the board has room for a single report.
TEST(WoodenHapticsDevice, ABoardThatIsStillStartingIsAskedOnceAndWaitedFor) {
  Bench bench({.boot = 1s});
  ASSERT_TRUE(bench.reaches(State::kOpening, 100ms));
  bench.run(900ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kOpening);
  EXPECT_LE(bench.arm.most_waiting(), 1);
  EXPECT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  EXPECT_EQ(bench.device.counts()[DeviceCount::kSilences], 0U);
}

TEST(WoodenHapticsDevice, PositionsAreThoseOfTheTipRelativeToTheCentre) {
  Dice dice(1);
  for (const char* model : {"woodenhaptics_v2019", "polhem_v1"}) {
    Bench bench({.model = model});
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    for (int i = 0; i < 200; ++i) {
      const Vec3 to = 0.06 * dice.direction();
      bench.move_to(to);
      bench.run(3ms);
      ASSERT_TRUE(bench.sample);
      ASSERT_EQ(bench.sample->at, bench.now);
      ASSERT_LT((bench.sample->position - to).norm(), 200e-6) << "more than counts can be rounded";
    }
    EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], 0U);
  }
}

TEST(WoodenHapticsDevice, JointsCarryTheTipAndTurnAsItMoves) {
  Dice dice(4);
  for (const char* name : {"woodenhaptics_v2019", "polhem_v1"}) {
    const woodenhaptics::Model& model = *woodenhaptics::find_model(name);
    Bench bench({.model = name});
    ASSERT_EQ(bench.device.info().joints, (std::vector<std::string>{"A", "B", "C"}));
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    for (int i = 0; i < 100; ++i) {
      bench.move_to(0.06 * dice.direction());
      bench.run(3ms);
      ASSERT_TRUE(bench.sample);
      const Vec3 velocity = 0.2 * dice.direction();
      const Joints joints = bench.device.joints({.velocity = velocity});
      ASSERT_EQ(joints.count, 3U);
      const auto pose = woodenhaptics::pose_with(model, Vec3(joints.angle[0], joints.angle[1], joints.angle[2]));
      ASSERT_LT((pose.position - bench.sample->position).norm(), 1e-12);
      const Vec3 speeds(joints.velocity[0], joints.velocity[1], joints.velocity[2]);
      ASSERT_LT((pose.jacobian * speeds - velocity).norm(), 1e-12);
    }
  }
}

// The counter has 16 bits per revolution of the body. The arm is rotated by two and a half revolutions.
TEST(WoodenHapticsDevice, CountersThatWrapAreFollowed) {
  for (const double turns : {2.5, -2.5}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    const Vec3 centre = bench.arm.arm().angles_at(Vec3::Zero());
    const Vec3 angles = centre + Vec3(2 * std::numbers::pi * turns, 0, 0);
    for (double share = 0; share < 1; share += 1e-3) {
      bench.arm.turn_to(centre + share * (angles - centre));
      bench.step();
    }
    bench.arm.turn_to(angles);
    bench.run(3ms);
    ASSERT_EQ(bench.device.state(), State::kHomed);
    ASSERT_TRUE(bench.sample);
    EXPECT_LT((bench.sample->position - bench.arm.position()).norm(), 200e-6);
    EXPECT_LT(bench.sample->position.x(), -0.4) << "behind the column";
  }
}

TEST(WoodenHapticsDevice, TheSwitchAtTheTipIsButton0) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(3ms);
  EXPECT_EQ(bench.sample->buttons, 0U);
  bench.arm.close_switch(true);
  bench.run(3ms);
  EXPECT_EQ(bench.sample->buttons, 1U);
}

// A full-speed bus needs one frame per direction, so there are two reports in flight.
TEST(WoodenHapticsDevice, EveryPeriodOfAMillisecondHasItsSampleAndItsCommand) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  const int before = bench.arm.obeyed();
  int seen = 0;
  for (int i = 0; i < 1000; ++i) {
    bench.step(kForce);
    seen += bench.sample ? 1 : 0;
  }
  EXPECT_EQ(seen, 1000);
  EXPECT_GE(bench.arm.obeyed() - before, 999);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kUnanswered], 0U);
  EXPECT_LE(bench.arm.most_waiting(), 2);
}

TEST(WoodenHapticsDevice, WhatIsReturnedIsWhatTheMotorsGive) {
  Dice dice(2);
  for (const double max_current : {2.0, 0.5}) {
    Bench bench({}, max_current);
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    for (int i = 0; i < 200; ++i) {
      bench.move_to(0.06 * dice.direction());
      const Vec3 wanted = dice.within(0.5, 40) * dice.direction();
      bench.run(5ms, wanted);
      ASSERT_TRUE(bench.sample);
      ASSERT_LT((bench.written - bench.arm.force()).norm(), 0.01 * bench.written.norm() + 1e-3);
      ASSERT_LE(bench.written.norm(), wanted.norm() + bench.device.info().force_resolution);
      ASSERT_GT(bench.written.normalized().dot(wanted.normalized()), 0.99);
      for (std::size_t motor = 0; motor < 3; ++motor) {
        ASSERT_LE(std::abs(bench.arm.pulse_width(motor) - 0.5), 0.4 * max_current / 3 + 1e-9);
      }
    }
  }
}

TEST(WoodenHapticsDevice, ZeroDoesNotWaitForAnAnswer) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.set_fault(Fault::kSilent);
  bench.run(4ms, kForce);  // there are two reports in flight, and they are not answered
  ASSERT_TRUE(bench.arm.pushes());
  bench.step();
  EXPECT_EQ(bench.written, Vec3::Zero());
  bench.step();  // frame that transfers it
  EXPECT_FALSE(bench.arm.pushes());
}

/// This is for a server that is killed, stops or hangs (devices/safety/guardian.h).
TEST(WoodenHapticsDevice, ThePacketOfTheGuardianEndsTheForceAtOnce) {
  Bench bench;
  bench.home(kForce);
  bench.run(10ms, kForce);
  ASSERT_TRUE(bench.arm.pushes());
  ASSERT_TRUE(bench.arm.write(bench.now, woodenhaptics::driver({}).zero_packet));
  bench.now += 3ms;  // the driver does nothing
  bench.arm.advance(bench.now);
  EXPECT_FALSE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, WithTheCableOutASelfPoweredBoardLetsGo) {
  Bench bench({.own_supply = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.unplug();
  bench.run(400ms, kForce);
  EXPECT_TRUE(bench.arm.pushes());
  EXPECT_EQ(bench.written, Vec3::Zero()) << "as far as the driver can tell";
  bench.run(101ms, kForce);
  EXPECT_FALSE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ItsAmplifiersAreOffUntilTheFirstReport) {
  Bench bench;
  bench.arm.advance(bench.now += 1s);
  EXPECT_FALSE(bench.arm.amplifiers_on());
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  EXPECT_TRUE(bench.arm.amplifiers_on());
  EXPECT_FALSE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ReportsOfAnotherLengthDoNotFeedTheWatchdog) {
  LocalTime now{};
  FakeWoodenHaptics arm({});
  arm.advance(now);
  const std::vector<std::uint8_t> pushes{100, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  arm.write(now, pushes);
  for (int i = 0; i < 10; ++i) arm.advance(now += 1ms);
  EXPECT_TRUE(arm.pushes());
  for (int i = 0; i < 495; ++i) {
    arm.write(now, std::vector<std::uint8_t>(i % 2 == 0 ? 64 : 15, 0));
    arm.take_in(now += 1ms);
  }
  EXPECT_FALSE(arm.pushes());
}

TEST(WoodenHapticsDevice, AfterAPauseBeyondTheWatchdogTheOldForceIsOver) {
  for (const Duration pause : {Duration(300ms), Duration(700ms)}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    bench.run(20ms, kForce);
    bench.now += pause;
    bench.full = true;  // output buffer full
    bench.step(kForce);
    ASSERT_EQ(bench.device.state(), State::kHomed);
    EXPECT_EQ(bench.arm.pushes(), pause < 500ms);
    EXPECT_EQ(bench.written != Vec3::Zero(), pause < 500ms);
    bench.full = false;
    bench.run(3ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
  }
}

TEST(WoodenHapticsDevice, ALoopThatStoodStillTakesUpWhereItWas) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.now += 300ms;
  bench.step(kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_TRUE(bench.sample);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kSilences], 0U);
}

TEST(WoodenHapticsDevice, AMomentaryEncoderJumpCostsOnlySamples) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.set_fault(Fault::kJumps);
  bench.run(2ms, kForce);  // reads the earlier reports
  const DeviceCounts before = bench.device.counts();
  bench.run(4ms, kForce);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kAnswers], before[DeviceCount::kAnswers]);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], before[DeviceCount::kImplausible] + 4);
  EXPECT_FALSE(bench.sample);
  bench.arm.set_fault(Fault::kNone);
  bench.run(3ms, kForce);
  ASSERT_TRUE(bench.sample);
  EXPECT_LT(bench.sample->position.norm(), 200e-6);
  EXPECT_TRUE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ASafeDeviceIsHomedAndArmedAgainAfterAReplug) {
  Bench bench;
  const auto home = [&] {
    bench.arm.turn_to(bench.arm.arm().calibration().cwiseProduct(bench.arm.arm().per_count()));
    bench.arm.press_calibrate();
  };
  expect_homing_and_arming_after_a_replug(bench, bench.arm, home, [&](LocalTime now) { bench.arm.advance(now); });
}

}  // namespace
}  // namespace tendon::woodenhaptics_device_test
