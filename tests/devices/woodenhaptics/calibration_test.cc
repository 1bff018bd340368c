// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

#include <gtest/gtest.h>

#include "tests/devices/woodenhaptics/woodenhaptics_bench.h"

namespace tendon::calibration_test {
namespace {

using State = Device::State;
using Fault = FakeWoodenHaptics::Fault;
using Bench = WoodenHapticsBench;
using namespace std::chrono_literals;

TEST(WoodenHapticsDevice, WithoutTheButtonItIsNeverHomed) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.run(5s, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_EQ(bench.arm.calibrations(), 0);
  EXPECT_EQ(bench.most_lawless, 0);
  EXPECT_GT(bench.arm.obeyed(), 4900) << "and its watchdog is fed with zeros";
}

TEST(WoodenHapticsDevice, OneReportOfAPressedButtonIsNotEnough) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.run(10ms, kForce);
  bench.arm.press_calibrate();
  bench.run(8ms, kForce);
  EXPECT_EQ(bench.arm.calibrations(), 0);
  bench.run(8ms, kForce);
  EXPECT_EQ(bench.arm.calibrations(), 1);
  EXPECT_EQ(bench.device.state(), State::kUnhomed) << "nor is one that has the counters";
  bench.run(20ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_EQ(bench.arm.calibrations(), 1);
}

TEST(WoodenHapticsDevice, TheButtonEndsTheForceAtOnceAndCalibratesAnew) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  ASSERT_TRUE(bench.arm.pushes());
  bench.most_lawless = 0;
  bench.arm.press_calibrate();
  bench.run(4ms, kForce);
  EXPECT_FALSE(bench.arm.pushes());
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_LE(bench.most_lawless, 3) << "a frame for the report, one for the answer";
}

TEST(WoodenHapticsDevice, CountersNotSetAsToldAreNoCalibration) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  bench.arm.press_calibrate();
  for (int i = 0; i < 100 && bench.arm.calibrations() == 0; ++i) bench.step();
  bench.arm.set_fault(Fault::kJumps);
  bench.run(100ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kFailedSetups], 1U);
  EXPECT_FALSE(bench.arm.pushes());
  bench.arm.set_fault(Fault::kNone);
  bench.run(100ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed) << "until the button is pressed again";
  EXPECT_TRUE(bench.reaches(State::kHomed, 1s));
}

// Found by tests/fuzz: if a board stops answering, this is not a request for a second calibration.
TEST(WoodenHapticsDevice, TheCountersAreNotSetAgainUnlessItIsAskedForAgain) {
  int until_set = 0;
  for (const bool silent : {false, true}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
    bench.arm.press_calibrate();
    if (!silent) {
      for (; until_set < 100 && bench.arm.calibrations() == 0; ++until_set) bench.step();
      ASSERT_EQ(bench.arm.calibrations(), 1);
      continue;
    }
    for (int i = 1; i < until_set; ++i) bench.step();
    ASSERT_EQ(bench.arm.calibrations(), 0) << "command 1 is on the bus";
    bench.arm.set_fault(Fault::kSilent);  // the request is the last message
    bench.run(90ms);
    EXPECT_EQ(bench.arm.calibrations(), 1);
  }
}

TEST(WoodenHapticsDevice, ABoardThatWasCalibratedBeforeIsNotBelievedToBe) {
  for (const bool own_supply : {false, true}) {
    Bench bench({.own_supply = own_supply});
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    bench.run(20ms, kForce);
    bench.arm.unplug();
    bench.arm.plug();  // between two periods
    bench.step(kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    EXPECT_FALSE(bench.sample);
    EXPECT_EQ(bench.written, Vec3::Zero());
    EXPECT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
    bench.run(1s, kForce);
    EXPECT_EQ(bench.device.state(), State::kUnhomed);
    EXPECT_FALSE(bench.arm.pushes());
    EXPECT_TRUE(bench.reaches(State::kHomed, 1s, kForce));
    bench.run(10ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
  }
}

}  // namespace
}  // namespace tendon::calibration_test
