// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"

namespace tendon::whole_handle_test {
namespace {

using namespace std::chrono_literals;

SimulatedDevice::Config point() {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  return config;
}

SimulatedDevice::Config whole() {
  SimulatedDevice::Config config = point();
  config.max_force = 4;
  config.rotation = {.inertia = 1e-5, .max_torque = 0.2};
  config.gripper = {.open = 0.5, .arm = 0.06, .mass = 0.02, .start = 0.25, .max_force = 3};
  return config;
}

const Effort kAsked{.force = {1, -2, 2}, .torque = {0.01, 0.02, -0.1}, .grip = -0.5};

TEST(WholeHandle, ADeviceWithoutThePartsHasNeitherAndGivesNeither) {
  SimulatedDevice device(point());
  const auto sample = device.read(LocalTime(0s));
  EXPECT_FALSE(sample->orientation || sample->opening);
  EXPECT_FALSE(device.info().measures_orientation || device.info().gripper);
  EXPECT_EQ(device.info().max_torque, 0);
  EXPECT_EQ(device.rotation(), nullptr);
  EXPECT_EQ(device.gripper(), nullptr);
  EXPECT_EQ(device.apply_all(kAsked), (Effort{.force = kAsked.force}));
}

TEST(WholeHandle, SaysItsPartsInItsDataSheetAndInEverySample) {
  auto config = whole();
  config.rotation->start = Vec3(0, 0, 0.3);
  config.rotation->encoder_step = 1e-4;
  SimulatedDevice device(config);
  EXPECT_TRUE(device.info().measures_orientation);
  EXPECT_EQ(device.info().max_torque, 0.2);
  EXPECT_EQ(device.info().angular_resolution, 1e-4);
  EXPECT_EQ(device.info().gripper, (DeviceInfo::Gripper{.open = 0.5, .arm = 0.06, .max_force = 3}));
  const auto sample = device.read(LocalTime(0s));
  EXPECT_EQ(sample->orientation, rotation_by({0, 0, 0.3}));
  EXPECT_NEAR(*sample->opening, 0.25, 1e-15);
}

TEST(WholeHandle, EachPartMovesByItsOwnEffort) {
  Bench bench(whole());
  EXPECT_EQ(bench.device().apply_all(kAsked), kAsked);
  bench.wait(10ms);
  EXPECT_NEAR((bench.truth().velocity - kAsked.force * 0.1).norm(), 0, 1e-12);
  EXPECT_NEAR((bench.device().rotation()->truth().angular_velocity - kAsked.torque * 1e3).norm(), 0, 1e-9);
  EXPECT_NEAR(bench.device().gripper()->truth().velocity, -0.25, 1e-12);
}

TEST(WholeHandle, TheApplyOfAForceEndsTorqueAndGrip) {
  Bench bench(whole());
  bench.device().apply_all(kAsked);
  EXPECT_EQ(bench.device().apply(kAsked.force), kAsked.force);
  bench.wait(10ms);
  EXPECT_EQ(bench.device().rotation()->truth().angular_velocity, Vec3::Zero());
  EXPECT_EQ(bench.device().gripper()->truth().velocity, 0);
}

TEST(WholeHandle, ThePositionLivesAsWithoutThePartsToTheLastBit) {
  auto config = point();
  config.coulomb_friction = 0.05;
  config.max_force = 1e9;
  config.hand = OperatorHand::Config{.stiffness = 300,
                                     .damping = 2,
                                     .mass = 0.05,
                                     .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 1})};
  auto more = config;
  more.rotation = whole().rotation;
  more.gripper = whole().gripper;
  Bench a(config);
  Bench z(more);
  Dice dice(7);
  for (int i = 0; i < 500; ++i) {
    const Vec3 force = random_vector(dice, 5);
    a.device().apply(force);
    z.device().apply_all({.force = force, .torque = random_vector(dice, 0.01), .grip = dice.within(-1, 1)});
    const Duration interval(static_cast<Duration::rep>(dice.within(0.3e6, 2e6)));
    ASSERT_EQ(a.wait(interval), z.wait(interval));
    ASSERT_EQ(a.truth().hand_work, z.truth().hand_work);
  }
}

TEST(WholeHandle, AWrenchTooLargeIsShortenedAndKeepsItsDirection) {
  SimulatedDevice device(whole());
  Dice dice(1);
  int shortened = 0;
  for (int i = 0; i < 2000; ++i) {
    const Effort asked{.force = random_vector(dice, 8), .torque = random_vector(dice, 0.4), .grip = dice.within(-6, 6)};
    const Effort given = device.apply_all(asked);
    ASSERT_LE(given.force.norm(), 4 * (1 + 1e-15));
    ASSERT_LE(given.torque.norm(), 0.2 * (1 + 1e-15));
    const double share = given.force.norm() / asked.force.norm();
    ASSERT_NEAR((given.force - share * asked.force).norm(), 0, 1e-14);
    ASSERT_NEAR((given.torque - share * asked.torque).norm(), 0, 1e-14);
    const double most = std::min({1.0, 4 / asked.force.norm(), 0.2 / asked.torque.norm()});
    ASSERT_NEAR(share, most, 1e-14) << "no more is taken than has to be";
    ASSERT_EQ(given.grip, std::clamp(asked.grip, -3.0, 3.0));
    shortened += share < 1 ? 1 : 0;
  }
  EXPECT_GT(shortened, 500);
}

TEST(WholeHandle, AHugeEffortIsShortenedAndOneThatIsNoNumberIsNone) {
  SimulatedDevice device(whole());
  const Effort huge = device.apply_all({.force = {1e300, 0, 0}, .torque = {0, 1e300, 0}, .grip = 1e300});
  EXPECT_NEAR(huge.torque.y(), 0.2, 1e-15);
  EXPECT_EQ(huge.grip, 3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (Effort bad : {Effort{.force = {0, nan, 0}}, Effort{.torque = {0, nan, 0}}, Effort{.grip = nan}}) {
    bad.force.x() = 1;
    bad.torque.x() = 0.1;
    EXPECT_EQ(device.apply_all(bad), Effort{});
  }
}

TEST(WholeHandle, PassiveRotationTakesNoTorqueAndSharesNothing) {
  auto config = whole();
  config.rotation->max_torque.reset();
  config.gripper->max_force.reset();
  Bench bench(config);
  EXPECT_EQ(bench.device().info().max_torque, 0);
  EXPECT_EQ(bench.device().apply_all({.force = {2, 0, 0}, .torque = {9, 9, 9}, .grip = 1}),
            (Effort{.force = {2, 0, 0}}));
  bench.wait(5ms);
  EXPECT_EQ(bench.device().rotation()->truth().angular_velocity, Vec3::Zero());
  EXPECT_EQ(bench.device().gripper()->truth().velocity, 0);
}

TEST(WholeHandle, TheWatchdogEndsTorqueAndGripWithTheForce) {
  auto config = whole();
  config.watchdog = 5ms;
  Bench bench(config);
  bench.device().apply_all(kAsked);
  bench.wait(30ms);
  EXPECT_TRUE(bench.truth().watchdog_fired);
  EXPECT_NEAR((bench.truth().velocity - kAsked.force * 0.05).norm(), 0, 1e-12);
  EXPECT_NEAR((bench.device().rotation()->truth().angular_velocity - kAsked.torque * 500).norm(), 0, 1e-9);
  EXPECT_NEAR(bench.device().gripper()->truth().velocity, -0.125, 1e-12);
  bench.device().apply_all(kAsked);
  bench.wait(1ms);
  EXPECT_NEAR((bench.device().rotation()->truth().angular_velocity - kAsked.torque * 600).norm(), 0, 1e-9);
}

TEST(WholeHandle, TransportDelayHoldsForTorqueGripAndOrientation) {
  auto config = whole();
  config.force_delay = 3ms;
  config.sample_delay = 2ms;
  Bench bench(config);
  EXPECT_EQ(bench.device().apply_all(kAsked), kAsked) << "what is returned is what is under way";
  bench.wait(5ms);
  EXPECT_EQ(bench.device().rotation()->truth().angular_velocity, Vec3::Zero());
  EXPECT_EQ(bench.device().gripper()->truth().velocity, 0);
  bench.device().apply_all({});
  bench.wait(1ms);
  EXPECT_NEAR((bench.device().rotation()->truth().angular_velocity - kAsked.torque * 100).norm(), 0, 1e-9);
  EXPECT_NEAR(bench.device().gripper()->truth().velocity, -0.025, 1e-12);
  bench.wait(20ms);
  EXPECT_NEAR((bench.device().rotation()->truth().angular_velocity - kAsked.torque * 500).norm(), 0, 1e-9);
  EXPECT_NEAR((bench.truth().velocity - kAsked.force * 0.05).norm(), 0, 1e-12);
}

TEST(WholeHandle, TheHandPressesButtonsWhenItsListSays) {
  auto config = point();
  config.presses = {{.button = 0, .from = 2ms, .length = 3ms}, {.button = 4, .from = 4ms, .length = 10ms}};
  config.button_after = 12ms;
  SimulatedDevice device(config);
  for (int ms = 0; ms < 20; ++ms) {
    const bool first = (ms >= 2 && ms < 5) || ms >= 12;
    const std::uint32_t expected = (first ? 1U : 0U) | (ms >= 4 && ms < 14 ? 16U : 0U);
    EXPECT_EQ(device.read(LocalTime(1s + ms * 1ms))->buttons, expected) << ms;
  }
}

TEST(WholeHandle, RefusesAPressThatCannotBe) {
  for (const SimulatedDevice::Config::Press press :
       {SimulatedDevice::Config::Press{.button = 32, .from = 0ms, .length = 1ms}, {0, -1ms, 1ms}, {0, 0ms, 0ms}}) {
    auto config = point();
    config.presses = {press};
    EXPECT_THROW(SimulatedDevice{config}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::whole_handle_test
