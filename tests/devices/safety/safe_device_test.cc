// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/safe_device.h"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/devices/safety/safety_rig.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::safe_device_test {
namespace {

using namespace std::chrono_literals;
using By = SafeDevice::Arming::By;

TEST(SafeDevice, GivesNothingUntilItIsArmedByRequest) {
  Rig rig;
  EXPECT_EQ(rig.steps_all(3000, kAll), kNothing);
  EXPECT_EQ(rig.puppet.told_all, kNothing);
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, WithNothingListedGivesEveryEffortToTheLastBitOnceArmed) {
  Rig rig;
  rig.arm();
  Dice dice(1);
  for (int i = 0; i < 1000; ++i) {
    const Effort asked{.force = dice.direction() * dice.decades(-3, 2),
                       .torque = dice.direction() * dice.decades(-4, 1),
                       .grip = dice.within(-5, 5)};
    ASSERT_EQ(rig.step_all(asked), asked);
    ASSERT_EQ(rig.puppet.told_all, asked);
  }
}

TEST(SafeDevice, PassesOnEveryReadingAsItIs) {
  Rig rig;
  rig.puppet.position = {1e-3, 2e-3, 3e-3};
  rig.puppet.buttons = 5;
  rig.puppet.age = 300us;
  const auto sample = rig.safe.read(rig.now);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->position, rig.puppet.position);
  EXPECT_EQ(sample->at, rig.now - 300us);
  EXPECT_EQ(sample->buttons, 5U);
}

TEST(SafeDevice, IsNotArmedWhileAnythingSpeaksAgainstIt) {
  const auto still_unarmed = [](const char* why, const SafeDevice::Config& config, const auto& disturb) {
    Rig rig(config);
    for (int i = 0; i < 500; ++i) {
      if (i > 20) rig.safe.arm();
      const Vec3 asked = disturb(rig, i);
      EXPECT_EQ(rig.step(asked), Vec3::Zero()) << why;
    }
    EXPECT_NE(rig.state(), SafetyState::kArmed) << why;
    EXPECT_EQ(rig.safe.status().faults, 0U) << why << ": there was no force to take away";
  };
  still_unarmed("the handle moves", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.position.x() += 30e-6;  // 0.03 m/s
    return Vec3::Zero();
  });
  still_unarmed("a force is asked for", {}, [](Rig&, int) { return Vec3(0, 0.11, 0); });
  still_unarmed("what is asked for is no number", {}, [](Rig&, int) { return Vec3(0, kNaN, 0); });
  still_unarmed("it is not homed", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.stage = Device::State::kUnhomed;
    return Vec3::Zero();
  });
  still_unarmed("it is silent", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.answers = false;
    return Vec3::Zero();
  });
  still_unarmed("of every 40 readings 11 in a row are missing", {}, [](Rig& rig, int i) -> Vec3 {
    rig.puppet.answers = i % 40 > 10;
    return Vec3::Zero();
  });
  SafeDevice::Config link;
  link.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 10ms};
  still_unarmed("what it says is old", link, [](Rig& rig, int) -> Vec3 {
    rig.puppet.age = 21ms;
    return Vec3::Zero();
  });
  SafeDevice::Config button;
  button.dead_man = DeadManSwitch::Config{.button = 2};
  still_unarmed("the dead man's button is not held", button, [](Rig& rig, int) -> Vec3 {
    rig.puppet.buttons = 0b1011;
    return Vec3::Zero();
  });
}

TEST(SafeDevice, BelievesThatTheHandleRestsOnlyWhenItHasStayedForAWhile) {
  for (const double speed : {0.0, 0.015, 0.025}) {
    Rig rig;
    int steps = 0;
    while (rig.state() != SafetyState::kArmed && steps < 3000) {
      rig.puppet.position.y() += speed * 1e-3;
      rig.step();
      rig.safe.arm();
      ++steps;
    }
    EXPECT_EQ(steps, speed < 0.02 ? 51 : 3000) << speed;
  }
}

TEST(SafeDevice, ForgetsARequestThatWasNotGrantedInTime) {
  for (const int late : {999, 1001}) {
    Rig rig;
    rig.steps(60);
    rig.safe.arm();
    rig.steps(late, kPush);  // a force demand prevents arming
    rig.steps(10);
    EXPECT_EQ(rig.state() == SafetyState::kArmed, late < 1000) << late;
  }
}

TEST(SafeDevice, ArmedAtTheStartIsArmedByItselfOnceAndNeverAgain) {
  SafeDevice::Config config;
  config.arming.by = By::kStart;
  Rig rig(config);
  rig.steps(5000, kPush);
  EXPECT_EQ(rig.state(), SafetyState::kHomed) << "a force is in the way";
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
  EXPECT_EQ(rig.step(kPush), kPush);
  rig.step(Vec3::Constant(kNaN));
  rig.steps(5000);
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.safe.arm();
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
  EXPECT_EQ(rig.safe.times_armed(), 2U);
}

TEST(SafeDevice, WhatIsNoNumberIsNothingAndAFaultThatStays) {
  for (const Effort& bad : {Effort{.force = {1, kNaN, 0}}, Effort{.force = {1, INFINITY, 0}},
                            Effort{.force = kPush, .torque = {0, kNaN, 0}},
                            Effort{.force = kPush, .torque = {0, 0, INFINITY}}, Effort{.force = kPush, .grip = kNaN}}) {
    SCOPED_TRACE(testing::Message() << bad.force.transpose() << "; " << bad.torque.transpose() << "; " << bad.grip);
    Rig rig;
    rig.arm();
    rig.step(kPush);
    EXPECT_EQ(rig.step_all(bad), kNothing);
    EXPECT_EQ(rig.fault(), SafetyFault::kForceNotFinite);
    EXPECT_EQ(rig.steps_all(5000, kAll), kNothing);
    rig.arm();
    EXPECT_EQ(rig.step(kPush), kPush);
    EXPECT_EQ(rig.fault(), SafetyFault::kForceNotFinite) << "it is still said what was last";
  }
}

TEST(SafeDevice, AHandleThatFliesIsLetGoForGoodAlsoWhenItRestsAgain) {
  Rig rig({.speed_trip = SpeedTrip::Config{.max = 1}});
  rig.arm();
  for (int i = 0; i < 50; ++i) {
    rig.puppet.position.y() += 0.9e-3;
    ASSERT_EQ(rig.step(kPush), kPush);
  }
  Vec3 applied = kPush;
  for (int i = 0; i < 17; ++i) {  // at most the window of the estimator
    rig.puppet.position.y() += 1.2e-3;
    applied = rig.step(kPush);
  }
  EXPECT_EQ(applied, Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kTooFast);
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kFault);
}

TEST(SafeDevice, AfterEachArmingAllIsRampedIn) {
  Rig rig({.ramp_in = RampIn::Config{.time = 100ms}});
  for (int time = 0; time < 2; ++time) {
    rig.arm();
    for (int ms = 1; ms <= 120; ++ms) {
      SCOPED_TRACE(ms);
      expect_near(rig.step_all(kAll), std::min(1.0, ms / 100.0) * kAll);
    }
    rig.step(Vec3::Constant(kNaN));
  }
}

TEST(SafeDevice, ASilentDeviceFallsToZeroWithinTheWatchdogsRamp) {
  Rig rig({.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 10ms}});
  rig.arm();
  rig.step_all(kAll);
  rig.puppet.answers = false;
  EXPECT_EQ(rig.steps_all(20, kAll), kAll);
  for (int ms = 0; ms < 10; ++ms) {
    SCOPED_TRACE(ms);
    expect_near(rig.step_all(kAll), (1 - ms / 10.0) * kAll);
    ASSERT_EQ(rig.state(), SafetyState::kArmed);
  }
  EXPECT_EQ(rig.step_all(kAll), kNothing);
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  EXPECT_EQ(rig.fault(), SafetyFault::kDeviceSilent);
  rig.puppet.answers = true;
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.safe.status().faults, 1U);
}

TEST(SafeDevice, ADeviceThatRepeatsItsLastWordIsSilentToo) {
  Rig rig({.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 0ms}});
  rig.arm();
  for (int ms = 1; ms <= 20; ++ms) {
    rig.puppet.age += 1ms;
    ASSERT_EQ(rig.step(kPush), kPush);
  }
  rig.puppet.age += 1ms;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
}

TEST(SafeDevice, AWorldThatStoodStillIsNotGoneOnWith) {
  Rig rig({.command_watchdog = Watchdog::Config{.timeout = 30ms, .ramp = 10ms}});
  rig.arm();
  rig.step(kPush);
  rig.now += 29ms;
  EXPECT_EQ(rig.step(kPush), kPush);
  rig.now += 30ms;
  EXPECT_EQ(rig.step(kPush), kPush) << "the ramp begins here";
  EXPECT_NEAR(rig.steps(5, kPush).norm(), 2.5, 1e-12);
  EXPECT_EQ(rig.steps(5, kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kCommandSilent);
}

TEST(SafeDevice, AForceThatTheGuardianHasEndedNeedsArmingAgain) {
  const std::atomic<bool> stands{true};
  Rig rig({.guardian = &stands});
  rig.arm();
  rig.step(kPush);
  rig.now += 18ms;
  EXPECT_EQ(rig.step(kPush), kPush) << "19 ms: the guardian has not looked yet";
  rig.step(Vec3::Zero());
  rig.now += 1s;
  EXPECT_EQ(rig.step(kPush), kPush) << "there was no force to end";
  rig.now += 19ms;
  EXPECT_EQ(rig.steps(500, kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kCommandSilent);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, GivesNoForceAndIsNotArmedWithoutItsGuardian) {
  std::atomic<bool> stands{true};
  Rig rig({.guardian = &stands});
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
  stands = false;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kGuardianLost);
  rig.safe.arm();
  EXPECT_EQ(rig.steps(100, Vec3::Zero()), Vec3::Zero());
  EXPECT_EQ(rig.safe.status().state, SafetyState::kFault);
  stands = true;
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, WhoeverStandsStillByIntentNeedsArmingAgain) {
  Rig rig;
  rig.arm();
  rig.step(kPush);
  rig.safe.stand_still();
  EXPECT_EQ(rig.steps(500, kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kCommandSilent);
}

TEST(SafeDevice, AnUnpluggedDeviceNeedsHomingAndArmingAgain) {
  Rig rig;
  rig.arm();
  rig.step(kPush);
  rig.puppet.stage = Device::State::kAbsent;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kDeviceLost);
  for (const auto stage : {Device::State::kOpening, Device::State::kFirmware, Device::State::kUnhomed}) {
    rig.puppet.stage = stage;
    rig.safe.arm();
    EXPECT_EQ(rig.steps(50), Vec3::Zero());
    EXPECT_FALSE(rig.seen) << "positions without an origin are none";
  }
  rig.puppet.stage = Device::State::kHomed;
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, APositionThatJumpsIsNotSeenAndThoseAfterItAre) {
  Rig rig({.step_bound = StepBound::Config{.max_speed = 10}});
  rig.arm();
  rig.puppet.position.x() = 0.2;  // 65536 counts of a wrapped encoder
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_FALSE(rig.seen);
  EXPECT_EQ(rig.fault(), SafetyFault::kPositionJumped);
  rig.step();
  EXPECT_TRUE(rig.seen);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush) << "the jump is no speed";
}

TEST(SafeDevice, APositionOrAnOpeningThatIsNoNumberIsNotSeenAndAFault) {
  for (const bool opening : {false, true}) {
    SCOPED_TRACE(opening ? "opening" : "position");
    Rig rig;
    rig.puppet.opening = 0.2;
    rig.arm();
    (opening ? *rig.puppet.opening : rig.puppet.position.z()) = kNaN;
    EXPECT_EQ(rig.step_all(kAll), kNothing);
    EXPECT_FALSE(rig.seen);
    EXPECT_EQ(rig.fault(), SafetyFault::kPositionNotFinite);
  }
}

TEST(SafeDevice, SaysTheForceLimitAsItsOwn) {
  SafeDevice::Config config;
  config.force_limit = ForceLimit::Config{.max = 4};
  EXPECT_EQ(Rig(config).safe.info().max_force, 4);
  config.force_limit->max = 40;
  EXPECT_EQ(Rig(config).safe.info().max_force, 10) << "the device's";
}

TEST(SafeDevice, HeatIsThatOfTheForceReallyHeld) {
  SafeDevice::Config config;
  config.heat_limit = HeatLimit::Config{.peak = 8, .continuous = 2, .time_constant = 1s};
  config.force_limit = ForceLimit::Config{.max = 2};
  Rig rig(config);
  rig.arm();
  EXPECT_NEAR(rig.steps(20'000, {9, 0, 0}).norm(), 2, 1e-12) << "2 N are borne for ever, whatever is asked";
  config.force_limit.reset();
  Rig warm(config);
  warm.arm();
  EXPECT_NEAR(warm.steps(10, {8, 0, 0}).norm(), 8, 1e-12);
  EXPECT_LT(warm.steps(20'000, {8, 0, 0}).norm(), 2.01);
  warm.steps(20'000);
  EXPECT_NEAR(warm.step({8, 0, 0}).norm(), 8, 1e-6) << "cool again";
}

TEST(SafeDevice, RefusesImpossibleValuesNamingTheField) {
  Puppet puppet;
  const auto make = [&puppet](const SafeDevice::Config& config) { const SafeDevice device(config, puppet); };
  expect_refusals(SafeDevice::Config(), make,
                  {
                      {"arming.rest_speed", [](auto& c) { c.arming.rest_speed = 0; }},
                      {"arming.rest_force", [](auto& c) { c.arming.rest_force = kNaN; }},
                      {"arming.patience", [](auto& c) { c.arming.patience = {}; }},
                      {"dead_man", [](auto& c) { c.arming.by = By::kDeadMan; }},
                      {"link_watchdog.timeout", [](auto& c) { c.link_watchdog.emplace(); }},
                      {"command_watchdog.timeout", [](auto& c) { c.command_watchdog.emplace(); }},
                      {"speed_trip.max", [](auto& c) { c.speed_trip.emplace(); }},
                      {"arming.rest_torque", [](auto& c) { c.arming.rest_torque = 0; }},
                      {"torque_limit.max", [](auto& c) { c.torque_limit.emplace(); }},
                      {"torque_growth_limit.rate", [](auto& c) { c.torque_growth_limit.emplace(); }},
                      {"turn_trip.max", [](auto& c) { c.turn_trip.emplace(); }},
                      {"grip_limit.max", [](auto& c) { c.grip_limit.emplace(); }},
                      {"grip_growth_limit.rate", [](auto& c) { c.grip_growth_limit.emplace(); }},
                  });
}

}  // namespace
}  // namespace tendon::safe_device_test
