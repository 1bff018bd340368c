// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_environment.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::simulated_environment_test {
namespace {

using namespace std::chrono_literals;
using Wall = SimulatedEnvironment::Wall;

SimulatedDevice::Config among(std::vector<Wall> walls) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.force_sensor.emplace();
  config.environment.emplace().walls = std::move(walls);
  return config;
}

const Wall kFloor{.normal = {0, 0, 2}, .stiffness = 1000};

TEST(SimulatedEnvironment, BetweenTwoWallsNoEnergyComesOrGoes) {
  auto config = among({{.point = {0.01, 0, 0}, .normal = {-1, 0, 0}, .stiffness = 20000},
                       {.point = {-0.01, 0, 0}, .normal = {1, 0, 0}, .stiffness = 500}});
  config.start_velocity = {0.3, 0, 0};
  Bench bench(config);
  int turns = 0;
  double before = 0.3;
  for (int i = 0; i < 60'000; ++i) {
    bench.wait(1ms);
    const double now = bench.truth().velocity.x();
    turns += now * before < 0 ? 1 : 0;
    before = now;
    if (bench.truth().environment_force.isZero()) {
      ASSERT_NEAR(std::abs(now), 0.3, 1e-3) << i << " ms, " << turns << " turns";
    }
  }
  EXPECT_GT(turns, 500);
}

TEST(SimulatedEnvironment, ABounceTakesHalfAPeriodOfMassAndSpring) {
  auto config = among({kFloor});
  config.start_velocity = {0, 0, -0.2};
  Bench bench(config);
  int inside = 0;
  while (bench.truth().velocity.z() < 0 || !bench.truth().environment_force.isZero()) {
    bench.wait(100us);
    ++inside;
  }
  EXPECT_NEAR(inside * 1e-4, std::numbers::pi * std::sqrt(0.1 / 1000), 2e-4);
}

TEST(SimulatedEnvironment, ForceSensorFeelsTheWallThatHoldsTheHandle) {
  auto wall = kFloor;
  wall.damping = 5;
  Bench bench(among({wall}));
  for (int i = 0; i < 2000; ++i) bench.push({0, 0, -3}, 1ms);
  EXPECT_NEAR(bench.truth().position.z(), -0.003, 1e-9);
  const auto sample = bench.device().read(LocalTime(123'456'789ns) + 2s);
  ASSERT_TRUE(sample && sample->hand_force);
  EXPECT_TRUE(sample->hand_force->isApprox(Vec3(0, 0, 3), 1e-6)) << sample->hand_force->transpose();
}

TEST(SimulatedEnvironment, FrictionHoldsAlongAWallUpToItsCone) {
  auto wall = kFloor;
  wall.damping = 5;
  wall.friction = 0.5;
  Bench bench(among({wall}));
  for (int i = 0; i < 1000; ++i) bench.push({0, 0, -4}, 1ms);
  const double settled = bench.truth().position.x();
  for (int i = 0; i < 1000; ++i) bench.push({1.99, 0, -4}, 1ms);
  EXPECT_EQ(bench.truth().position.x(), settled);
  for (int i = 0; i < 1000; ++i) bench.push({3, 0, -4}, 1ms);
  EXPECT_NEAR(bench.truth().velocity.x(), (3 - 0.5 * 4) / 0.1, 1e-3);
  EXPECT_NEAR(bench.truth().environment_force.x(), -2, 1e-6);
  for (int i = 0; i < 3000; ++i) bench.push({0, 0, -4}, 1ms);
  EXPECT_EQ(bench.truth().velocity.x(), 0) << "it has come to rest, and does not tremble";
}

TEST(SimulatedEnvironment, AMovingWallCarriesTheHandleAlongUntilItIsGone) {
  auto config = among({{.normal = {1, 0, 0}, .stiffness = 500, .speed = 0.02, .from = 100ms, .until = 1100ms}});
  config.environment->damping = 10;
  Bench bench(config);
  bench.wait(100ms);
  EXPECT_EQ(bench.truth().position.x(), 0);
  bench.wait(999ms);
  EXPECT_NEAR(bench.truth().velocity.x(), 0.02, 1e-4);
  EXPECT_NEAR(bench.truth().position.x(), 0.02 * 0.999 - 10 * 0.02 / 500, 1e-5);
  bench.wait(2ms);
  const double left = bench.truth().velocity.x();
  bench.wait(100ms);
  EXPECT_LT(bench.truth().velocity.x(), 1e-3 * left);
}

TEST(SimulatedEnvironment, AMediumBrakesAndItsFrictionSticks) {
  auto config = among({});
  config.environment->damping = 4;
  config.environment->friction = 0.5;
  Bench bench(config);
  for (int i = 0; i < 1000; ++i) bench.push({0.49, 0, 0}, 1ms);
  EXPECT_EQ(bench.truth().position.x(), 0);
  for (int i = 0; i < 1000; ++i) bench.push({1.3, 0, 0}, 1ms);
  EXPECT_NEAR(bench.truth().velocity.x(), (1.3 - 0.5) / 4, 1e-9);
  for (int i = 0; i < 1000; ++i) bench.push(Vec3::Zero(), 1ms);
  EXPECT_EQ(bench.truth().velocity.x(), 0);
}

TEST(SimulatedEnvironment, NothingIsThereBeforeItsTimeOrBesideItsSurface) {
  auto wall = kFloor;
  wall.from = 1s;
  auto config = among({wall});
  config.start_position = Vec3(0, 0, -0.001);
  Bench bench(config);
  bench.wait(1s);
  EXPECT_EQ(bench.truth().position.z(), -0.001);
  bench.wait(2ms);
  EXPECT_GT(bench.truth().environment_force.z(), 0);
  bench.wait(1s);
  EXPECT_GT(bench.truth().position.z(), 0);
  EXPECT_TRUE(bench.truth().environment_force.isZero());
}

TEST(SimulatedEnvironment, WhatIsWrongWithItIsNamed) {
  expect_refusals(among({kFloor}), Makes<SimulatedDevice>(),
                  {
                      {"environment.damping = ", [](auto& c) { c.environment->damping = -1; }},
                      {"environment.friction = ", [](auto& c) { c.environment->friction = NAN; }},
                      {"environment.walls = ", [](auto& c) { c.environment->walls.resize(17, kFloor); }},
                      {"environment.wall.point.y = ", [](auto& c) { c.environment->walls[0].point.y() = NAN; }},
                      {"environment.wall.normal = ", [](auto& c) { c.environment->walls[0].normal.setZero(); }},
                      {"environment.wall.stiffness = ", [](auto& c) { c.environment->walls[0].stiffness = 0; }},
                      {"environment.wall.damping = ", [](auto& c) { c.environment->walls[0].damping = -1; }},
                      {"environment.wall.friction = ", [](auto& c) { c.environment->walls[0].friction = -1; }},
                      {"environment.wall.speed = ", [](auto& c) { c.environment->walls[0].speed = NAN; }},
                      {"environment.wall.from = ", [](auto& c) { c.environment->walls[0].from = -1ms; }},
                      {"environment.wall.until = ", [](auto& c) { c.environment->walls[0].until = 0ms; }},
                      {"structural_mode.handle_mass = ",
                       [](auto& c) { c.structural_mode = {.handle_mass = 0.05, .stiffness = 100}; }},
                  });
}

}  // namespace
}  // namespace tendon::simulated_environment_test
