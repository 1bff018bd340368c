// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "devices/safety/safe_device.h"
#include "tests/tools/worlds/pressed_wall.h"
#include "tests/tools/worlds/watched_device.h"

namespace tendon::simulation::safe_world_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Rests at first, then moves back and forth through the wall.
SimulatedDevice::Config hand(const Vec3& to = Vec3(0.02, 0.004, 0)) {
  return moved_falcon(to, milliseconds(400), milliseconds(200));
}

/// N, in the next `duration`.
double peak_of(World& world, Log& log, Duration duration) {
  log.steps.clear();
  world.run_for(duration);
  return log.peak();
}

class Pluggable final : public Device {
 public:
  explicit Pluggable(Device& device) : device_(device) {}
  State stage = State::kHomed;

  const DeviceInfo& info() const noexcept override { return device_.info(); }
  State state() const noexcept override { return stage; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    auto sample = device_.read(now);
    if (stage != State::kHomed) sample.reset();
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return device_.apply(force); }

 private:
  Device& device_;
};

TEST(SafeWorld, TheLedgerBooksTheForceAfterTheSafetyLayerAndStaysPassive) {
  SimulatedDevice device(hand());
  WatchedDevice watched(device, {.friction = kBounds});
  SafeDevice::Config config;
  config.arming.by = SafeDevice::Arming::By::kStart;
  config.growth_limit = GrowthLimit::Config{.rate = 200};
  config.force_limit = ForceLimit::Config{.max = 3};
  config.heat_limit = HeatLimit::Config{.peak = 3, .continuous = 0.8, .time_constant = milliseconds(500)};
  config.workspace =
      Workspace::Config{.centre = Vec3(-0.02, 0, 0), .shape = Workspace::Sphere{.radius = 0.025}, .margin = 0.01};
  config.ramp_in = RampIn::Config{.time = milliseconds(300)};
  SafeDevice safe(config, watched);
  World world(world_config(safe.info()), safe);
  world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(5));
  int left = 0;
  for (const StepRecord& step : log.steps) {
    left += step.applied != step.force ? 1 : 0;
    ASSERT_LE(step.applied.norm(), step.permitted + 1e-12);
  }
  EXPECT_EQ(safe.status().state, SafetyState::kArmed);
  EXPECT_GT(log.peak(), 1);  // N: the wall is felt
  EXPECT_GT(left, 1000);     // steps in which the safety layer reduced the force
  EXPECT_GE(log.least_energy(), -1e-9);
  EXPECT_GE(watched.energy(), -1e-9);
}

TEST(SafeWorld, ADeviceReplugedInMidForceWaitsForHomingAndTheEnginesRequest) {
  SimulatedDevice device(hand(Vec3(0.015, 0, 0)));
  Pluggable plug(device);
  plug.stage = Device::State::kUnhomed;
  SafeDevice safe({}, plug);
  World world(world_config(safe.info()), safe);
  const std::size_t engine = world.add_controller(at_100_hz(), wall());
  Log log(world);

  EXPECT_EQ(peak_of(world, log, seconds(2)), 0);
  EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kNone) << "not ready is no fault";
  plug.stage = Device::State::kHomed;
  EXPECT_EQ(peak_of(world, log, seconds(2)), 0);
  EXPECT_TRUE(world.client(engine).rearm());
  EXPECT_GT(peak_of(world, log, seconds(3)), 1);

  plug.stage = Device::State::kAbsent;
  EXPECT_EQ(peak_of(world, log, milliseconds(200)), 0);
  EXPECT_EQ(safe.status().state, SafetyState::kFault);
  plug.stage = Device::State::kHomed;
  EXPECT_EQ(peak_of(world, log, seconds(2)), 0);
  EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kDeviceSilent);
  EXPECT_TRUE(world.client(engine).rearm());
  EXPECT_GT(peak_of(world, log, seconds(3)), 1);
  EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kNone);
}

TEST(SafeWorld, WhatItsEngineHasDisarmedInMidForceGivesNoneUntilItRearms) {
  for (const bool guarded : {true, false}) {
    SCOPED_TRACE(guarded ? "with a safety layer" : "without");
    SimulatedDevice device(hand(Vec3(0.015, 0, 0)));
    SafeDevice::Config config;
    config.arming.by = SafeDevice::Arming::By::kStart;
    SafeDevice safe(config, device);
    World world(world_config(device.info()), guarded ? static_cast<Device&>(safe) : device);
    const std::size_t engine = world.add_controller(at_100_hz(), wall());
    Log log(world);
    EXPECT_GT(peak_of(world, log, seconds(2)), 1);
    EXPECT_TRUE(world.client(engine).disarm());
    world.run_for(milliseconds(500));
    EXPECT_EQ(peak_of(world, log, seconds(2)), 0);
    EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kNone);
    if (guarded) {
      EXPECT_EQ(safe.status().state, SafetyState::kHomed);
    }
    EXPECT_TRUE(world.client(engine).rearm());
    EXPECT_GT(peak_of(world, log, seconds(3)), 1);
  }
}

}  // namespace
}  // namespace tendon::simulation::safe_world_test
