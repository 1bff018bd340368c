// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/rotation.h"
#include "devices/safety/safe_device.h"
#include "tests/devices/safety/safety_rig.h"
#include "tests/support/dice.h"

namespace tendon::safe_wrench_test {
namespace {

TEST(SafeWrench, IsNotArmedWhileATorqueOrAGripIsAskedFor) {
  for (const Effort& asked : {Effort{.torque = {0, 0.011, 0}}, Effort{.grip = -0.11}, Effort{.torque = {kNaN, 0, 0}}}) {
    Rig rig;
    for (int i = 0; i < 300; ++i) {
      rig.safe.arm();
      ASSERT_EQ(rig.step_all(asked), kNothing);
    }
    EXPECT_EQ(rig.state(), SafetyState::kHomed);
  }
  Rig rig;
  for (int i = 0; i < 300; ++i) {
    rig.step_all({.torque = {0, 0.009, 0}, .grip = 0.09});
    rig.safe.arm();
  }
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

TEST(SafeWrench, ForceAndTorqueAreShortenedByOneShareAndTheGripByItsOwn) {
  SafeDevice::Config config;
  config.force_limit = ForceLimit::Config{.max = 4};
  config.torque_limit = ForceLimit::Config{.max = 0.2};
  config.grip_limit = ForceLimit::Config{.max = 3};
  Rig rig(config);
  rig.arm();
  Dice dice(2);
  for (int i = 0; i < 2000; ++i) {
    const Effort asked{.force = dice.direction() * dice.within(0.1, 8),
                       .torque = dice.direction() * dice.within(0.01, 0.4),
                       .grip = dice.within(-6, 6)};
    const Effort given = rig.step_all(asked);
    const double share = std::min({1.0, 4 / asked.force.norm(), 0.2 / asked.torque.norm()});
    ASSERT_NEAR((given.force - share * asked.force).norm(), 0, 1e-12);
    ASSERT_NEAR((given.torque - share * asked.torque).norm(), 0, 1e-12);
    ASSERT_NEAR(given.grip, std::clamp(asked.grip, -3.0, 3.0), 1e-12);
  }
}

TEST(SafeWrench, NothingGrowsFasterThanItsRateAndAllFallAtOnce) {
  SafeDevice::Config config;
  config.torque_growth_limit = GrowthLimit::Config{.rate = 10};  // 10 mN·m per step
  config.grip_growth_limit = GrowthLimit::Config{.rate = 500};   // 0.5 N per step
  Rig rig(config);
  rig.arm();
  for (int i = 1; i <= 12; ++i) {
    const Effort given = rig.step_all(kAll);
    const double share = std::min(1.0, i * 0.1);
    ASSERT_NEAR(given.torque.y(), share * 0.1, 1e-12);
    ASSERT_NEAR((given.force - share * kAll.force).norm(), 0, 1e-12) << "the wrench keeps its direction";
    ASSERT_NEAR(given.grip, -std::min(2.0, i * 0.5), 1e-12);
  }
  EXPECT_EQ(rig.step_all(kNothing), kNothing);
  rig.steps_all(12, kAll);
  const Effort turned = rig.step_all({.torque = {0, -0.1, 0}, .grip = 2});
  EXPECT_NEAR(turned.torque.y(), -0.01, 1e-12) << "what reverses begins at zero";
  EXPECT_NEAR(turned.grip, 0.5, 1e-12);
}

TEST(SafeWrench, OutsideTheWorkspaceAWrenchIsReducedAsItsForce) {
  Rig rig({.workspace = Workspace::Config{.shape = Workspace::Sphere{.radius = 0.05}, .margin = 0.01}});
  rig.puppet.position = {0.055, 0, 0};
  rig.arm();
  const Effort outwards = rig.step_all({.force = {2, 0, 0}, .torque = {0, 0.1, 0}, .grip = 1});
  expect_near(outwards, {.force = {1, 0, 0}, .torque = {0, 0.05, 0}, .grip = 1});
  EXPECT_EQ(rig.step_all({.torque = {0, 0.1, 0}}), (Effort{.torque = {0, 0.1, 0}})) << "a torque pushes nobody out";
}

TEST(SafeWrench, AnOrientationThatIsNoRotationIsNotSeenAndAFault) {
  for (const Quat& bad : {Quat{0, 0, 0, 0}, Quat{1.01, 0, 0, 0}, Quat{1, kNaN, 0, 0}}) {
    Rig rig;
    rig.puppet.orientation = rotation_by({0.3, 0, 0});
    rig.arm();
    EXPECT_EQ(rig.step_all(kAll), kAll);
    EXPECT_TRUE(rig.seen);
    rig.puppet.orientation = bad;
    EXPECT_EQ(rig.step_all(kAll), kNothing);
    EXPECT_FALSE(rig.seen);
    EXPECT_EQ(rig.fault(), SafetyFault::kNoRotation);
  }
}

TEST(SafeWrench, AHandleThatSpinsIsLetGo) {
  for (const double speed : {9.0, 12.0}) {
    Rig rig({.turn_trip = TurnTrip::Config{.max = 10}});
    rig.puppet.orientation = Quat{};
    rig.arm();
    Effort given;
    for (int i = 0; i < 1000; ++i) {  // the quaternion can have either sign if the angle is more than 180°
      const Quat q = rotation_by(Vec3(1, 2, 2) / 3 * (speed * 1e-3 * i));
      rig.puppet.orientation = i % 2 == 0 ? q : Quat{-q.w, -q.x, -q.y, -q.z};
      given = rig.step_all(kAll);
    }
    EXPECT_EQ(given, speed < 10 ? kAll : kNothing);
    EXPECT_EQ(rig.fault(), speed < 10 ? SafetyFault::kNone : SafetyFault::kTurnsTooFast);
  }
}

TEST(SafeWrench, SaysItsLimitsAsItsOwnWhereThereIsAMotor) {
  SafeDevice::Config config;
  config.torque_limit = ForceLimit::Config{.max = 0.1};
  config.grip_limit = ForceLimit::Config{.max = 2};
  Puppet puppet;
  EXPECT_EQ(SafeDevice(config, puppet).info().max_torque, 0) << "a limit makes no motor";
  puppet.about.max_torque = 0.3;
  puppet.about.gripper = DeviceInfo::Gripper{.open = 0.5, .arm = 0.06, .max_force = 5};
  EXPECT_EQ(SafeDevice(config, puppet).info().max_torque, 0.1);
  EXPECT_EQ(SafeDevice(config, puppet).info().gripper->max_force, 2);
  puppet.about.max_torque = 0.05;
  EXPECT_EQ(SafeDevice(config, puppet).info().max_torque, 0.05);
}

}  // namespace
}  // namespace tendon::safe_wrench_test
