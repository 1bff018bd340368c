// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/tool_coupling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/refusal.h"

namespace tendon::tool_coupling_test {
namespace {

/// A tool in front of a wall at x = 0. It is integrated by the semi-implicit Euler method, as in a typical engine.
struct Tool {
  double mass;
  double step;
  double wall = 0;  ///< N/m
  double wall_damping = 0;
  Vec3 position = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();

  void go(const Vec3& pushed) {
    const double x = position.x();
    const Vec3 contact(x > 0 ? -wall * x - wall_damping * velocity.x() : 0, 0, 0);
    velocity += step / mass * (pushed + contact);
    position += step * velocity;
  }
};

Vec3 settle(const ToolCoupling& coupling, Tool& tool, const DeviceState& hand, int steps) {
  Vec3 felt = Vec3::Zero();
  for (int i = 0; i < steps; ++i) {
    const auto forces = coupling.couple(hand, tool.position, tool.velocity);
    tool.go(forces.on_tool);
    felt = forces.on_hand;
  }
  return felt;
}

TEST(ToolCoupling, AgainstAWallIsFeltInSeriesWithIt) {
  const ToolCoupling coupling({.stiffness = 500, .damping = 5, .tool_mass = 0.05, .step_s = 0.001});
  const double k = 500 / (1 + (5 + 500 * 0.001) * 0.001 / 0.05);
  EXPECT_NEAR(coupling.felt_stiffness(), k, 1e-9);
  Tool tool{.mass = 0.05, .step = 0.001, .wall = 1500, .wall_damping = 5};
  DeviceState hand;
  hand.position = Vec3(0.01, 0, 0);
  const Vec3 felt = settle(coupling, tool, hand, 3000);
  EXPECT_NEAR(felt.x(), -0.01 * k * 1500 / (k + 1500), 1e-6);
  EXPECT_NEAR(tool.position.x(), 0.01 * k / (k + 1500), 1e-8);
}

TEST(ToolCoupling, PutsEqualAndOppositeForcesOnHandAndTool) {
  const ToolCoupling coupling({});
  DeviceState hand;
  hand.position = Vec3(0.001, 0.002, -0.003);
  hand.velocity = Vec3(0.1, 0, 0.2);
  const auto forces = coupling.couple(hand, Vec3(0, 0.001, 0), Vec3(0, 0.1, 0));
  EXPECT_EQ(forces.on_hand, -forces.on_tool);
  EXPECT_GT(forces.on_tool.x(), 0) << "the tool is drawn to the hand";
}

TEST(ToolCoupling, HoldsAFreeToolStablyHoweverHardItIs) {
  // An explicit spring and damper are stable only if k·T² + 2·b·T < 4·m, which this exceeds 25 000 times.
  for (const double damping : {0.0, 100.0}) {
    const double most = std::numeric_limits<double>::max();
    const ToolCoupling coupling(
        {.stiffness = 1e6, .damping = damping, .tool_mass = 0.01, .step_s = 0.03, .max_force = most});
    Tool tool{.mass = 0.01, .step = 0.03, .position = Vec3(0.1, -0.2, 0.3)};
    settle(coupling, tool, DeviceState{}, 100);
    EXPECT_LT(tool.position.norm(), 1e-9);
  }
}

TEST(ToolCoupling, DoesNotThrowTheToolWhenTheHandIsSuddenlyElsewhere) {
  const ToolCoupling coupling({.max_force = 8});
  DeviceState hand;
  hand.position = Vec3(3, -4, 0);
  const auto forces = coupling.couple(hand, Vec3::Zero(), Vec3::Zero());
  EXPECT_LT((forces.on_tool - Vec3(4.8, -6.4, 0)).norm(), 1e-12);
}

TEST(ToolCoupling, MakesNoForceOfAHandThatIsNowhere) {
  DeviceState hand;
  hand.position = Vec3(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_FALSE(ToolCoupling({}).couple(hand, Vec3::Zero(), Vec3::Zero()).on_hand.allFinite());
}

TEST(ToolCoupling, CanBeMadeForTheStiffnessThatIsFelt) {
  const ToolCoupling::Config config{.stiffness = 1000, .damping = 14, .tool_mass = 0.05, .step_s = 0.001};
  const ToolCoupling coupling = ToolCoupling::felt_as(config);
  EXPECT_NEAR(coupling.felt_stiffness(), 1000, 1e-9);
  EXPECT_NEAR(coupling.couple(Vec3(0.002, 0, 0), Vec3::Zero()).on_hand.x(), -2, 1e-12);
  Tool tool{.mass = 0.05, .step = 0.001, .position = Vec3(0.01, 0, 0)};
  settle(coupling, tool, DeviceState{}, 500);
  EXPECT_LT(tool.position.norm(), 1e-9);
  EXPECT_EQ(thrown_by([] { ToolCoupling::felt_as({.stiffness = 1000, .tool_mass = 0.001}); }),
            "tool_mass = 0.001: expected more than stiffness·step_s², 0.001");
  EXPECT_THROW(ToolCoupling::felt_as({.stiffness = -1}), std::invalid_argument);
}

TEST(ToolCoupling, RefusesTheImpossible) {
  EXPECT_THROW(ToolCoupling({.stiffness = 0}), std::invalid_argument);
  EXPECT_THROW(ToolCoupling({.damping = -1}), std::invalid_argument);
  EXPECT_THROW(ToolCoupling({.tool_mass = 0}), std::invalid_argument);
  EXPECT_THROW(ToolCoupling({.step_s = HUGE_VAL}), std::invalid_argument);
  EXPECT_THROW(ToolCoupling({.max_force = std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::tool_coupling_test
