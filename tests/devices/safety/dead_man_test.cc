// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/safe_device.h"

#include <gtest/gtest.h>

#include "tests/devices/safety/safety_rig.h"

namespace tendon::dead_man_test {
namespace {

using namespace std::chrono_literals;
using By = SafeDevice::Arming::By;

SafeDevice::Config by_button() {
  SafeDevice::Config config;
  config.arming.by = By::kDeadMan;
  config.dead_man = DeadManSwitch::Config{.button = 2};
  return config;
}

TEST(DeadMan, WhoHoldsTheButtonHasForcesAndWhoLetsGoHasNoneAtOnce) {
  Rig rig(by_button());
  rig.steps(60);
  rig.safe.arm();  // no effect: only the dead-man switch arms
  rig.steps(60);
  ASSERT_EQ(rig.state(), SafetyState::kHomed);
  for (int press = 0; press < 3; ++press) {
    rig.puppet.buttons = 4;
    rig.step();
    ASSERT_EQ(rig.state(), SafetyState::kArmed);
    EXPECT_EQ(rig.step_all(kAll), kAll);
    rig.puppet.buttons = 0;
    EXPECT_EQ(rig.step_all(kAll), kNothing);
    EXPECT_EQ(rig.puppet.told_all, kNothing);
    EXPECT_EQ(rig.state(), SafetyState::kHomed);
    EXPECT_EQ(rig.steps_all(100, kAll), kNothing);
  }
  EXPECT_EQ(rig.safe.status().faults, 0U);
}

TEST(DeadMan, AButtonThatIsStuckFromTheStartArmsNothing) {
  Rig rig(by_button());
  rig.puppet.buttons = 4;
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
}

TEST(DeadMan, AfterAFaultTheButtonHasToBePressedAgain) {
  Rig rig(by_button());
  rig.steps(60);
  rig.puppet.buttons = 4;
  rig.step();
  rig.step(Vec3::Constant(kNaN));
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.puppet.buttons = 0;
  rig.step();
  rig.puppet.buttons = 4;
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

TEST(DeadMan, ThePressHoldsUntilTheHandIsStill) {
  Rig rig(by_button());
  for (int i = 0; i < 3000; ++i) {
    rig.puppet.position.x() += 50e-6;
    rig.puppet.buttons = i < 60 ? 0 : 4;
    rig.step();
  }
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.steps(60);
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

TEST(DeadMan, AfterADisarmTheButtonArmsOnlyOnceArmedAndPressedAnew) {
  Rig rig(by_button());
  rig.steps(60);
  const auto press = [&rig] {
    rig.puppet.buttons = 0;
    rig.steps(10);
    rig.puppet.buttons = 4;
    rig.steps(60);
  };
  press();
  ASSERT_EQ(rig.state(), SafetyState::kArmed);
  rig.safe.disarm();
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  press();
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.safe.arm();
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kHomed) << "a button that is held was pressed for something else";
  press();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

}  // namespace
}  // namespace tendon::dead_man_test
