// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/held_tool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "protocol/rotation.h"
#include "tests/support/refusal.h"

namespace tendon::held_tool_test {
namespace {

using std::chrono::microseconds;

/// A point above a rigid floor at z = −10 mm, with hinges of 1 N·m/rad that resist its rotation.
struct Floor {
  static constexpr double kHeight = -0.01;
  ToolEngine::Motion now{};
  ToolEngine::Six pull = ToolEngine::Six::Zero();
  int steps = 0;
  bool fails = false;
  double step_s = 0.001;

  bool touches() const { return now.position.z() <= kHeight; }
  ToolEngine::Six held() const {
    ToolEngine::Six c = ToolEngine::Six::Zero();
    if (touches()) c[2] = -pull[2];
    c.tail<3>() = rotated(inverse(now.orientation), -rotation_vector(now.orientation));
    return c;
  }
  bool step() {
    ++steps;
    if (fails) {
      now = {};
      return false;
    }
    now.velocity.head<3>() += step_s / 0.05 * pull.head<3>();
    now.velocity.tail<3>() += step_s / 2e-5 * (pull + held()).tail<3>();
    now.position += step_s * now.velocity.head<3>();
    if (touches()) {
      now.position.z() = kHeight;
      now.velocity[2] = 0;
    }
    now.orientation = unit(product(now.orientation, rotation_by(step_s * now.velocity.tail<3>())));
    return true;
  }
  ToolEngine engine() {
    return {.step_s = step_s,
            .motion = [this] { return now; },
            .pull = [this](const ToolEngine::Six& six) { pull = six; },
            .step = [this] { return step(); },
            .held = [this](bool) { return held(); },
            .contacts =
                [this](std::vector<Contact>& found) {
                  if (touches()) found.push_back({.normal = Vec3::UnitZ(), .gap = 0});
                }};
  }
};

/// Moves the hand from the origin to `x` in 0.5 s. The hand then rests for 0.5 s.
Touch press(HeldTool& tool, const Vec3& x, const Quat& turn = {}) {
  static std::int64_t ms = 0;
  Touch touch;
  for (int i = 1; i <= 1000; ++i) {
    DeviceState hand;
    hand.sampled = PeerTime(microseconds(1000 * ++ms));
    hand.position = std::min(1.0, i / 500.0) * x;
    hand.turning = Turning{.orientation = turn};
    touch = tool.answer(hand);
  }
  return touch;
}

TEST(HeldTool, IsFeltAsTheStiffnessOfItsConfigAtARigidFloor) {
  Floor floor;
  HeldTool tool({.stiffness = 800}, floor.engine());
  const Touch touch = press(tool, Vec3(0, 0, -0.013));
  EXPECT_NEAR(touch.force.z(), 0.003 * 800, 0.02 * 0.003 * 800);
  EXPECT_NEAR((*touch.stiffness)(2, 2), 800, 1e-3);
  EXPECT_NEAR((*touch.stiffness)(0, 0), 0, 1e-9);
  EXPECT_NEAR(touch.valid_radius, touch.force.norm() / 800, 1e-12);
  ASSERT_TRUE(touch.contact);
  EXPECT_NEAR((touch.contact->normal - Vec3::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR(touch.contact->gap, -0.003, 1e-9);
}

TEST(HeldTool, IsNotFeltInFreeSpace) {
  Floor floor;
  HeldTool tool({}, floor.engine());
  const Touch touch = press(tool, Vec3(0.01, 0.02, 0.03));
  EXPECT_LT(touch.force.norm(), 1e-6);
  EXPECT_TRUE(touch.stiffness->isZero(0));
  EXPECT_FALSE(touch.contact);
  EXPECT_LT((floor.now.position - Vec3(0.01, 0.02, 0.03)).norm(), 1e-9);
}

TEST(HeldTool, IsTurnedByTheHandleAboutTheSameAxis) {
  Floor floor;
  HeldTool tool({}, floor.engine());
  const Touch touch = press(tool, Vec3::Zero(), rotation_by(Vec3(0, 0.3, 0)));
  // In series: 2 sin(0.3 - x) = x
  EXPECT_NEAR(touch.torque->y(), -0.2, 0.002);
  EXPECT_NEAR(rotation_vector(floor.now.orientation).y(), 0.2, 0.002);
}

TEST(HeldTool, WithZUpTheDeviceYPointsUp) {
  Floor floor;
  HeldTool tool({.z_up = true}, floor.engine());
  const Touch touch = press(tool, Vec3(0.004, -0.013, 0.005));
  EXPECT_NEAR(touch.force.y(), 3, 0.06);
  EXPECT_LT(touch.force.cwiseAbs().minCoeff(), 1e-6);
  EXPECT_NEAR((*touch.stiffness)(1, 1), 1000, 1e-3);
  EXPECT_NEAR((touch.contact->normal - Vec3::UnitY()).norm(), 0, 1e-12);
  EXPECT_NEAR(floor.now.position.x(), 0.004, 1e-6);
  EXPECT_NEAR(floor.now.position.y(), -0.005, 1e-6) << "z of the device points to the operator, y of the scene away";
}

TEST(HeldTool, StepsAsOftenAsTimeHasPassedAtTheDevice) {
  Floor floor;
  HeldTool tool({.max_steps = 5}, floor.engine());
  auto steps = [&, before = 0](std::int64_t us) mutable {
    DeviceState hand;
    hand.sampled = PeerTime(microseconds(us));
    tool.answer(hand);
    return floor.steps - std::exchange(before, floor.steps);
  };
  EXPECT_EQ(steps(10'000), 1);
  EXPECT_EQ(steps(10'000), 0) << "the same state";
  EXPECT_EQ(steps(11'000), 1);
  EXPECT_EQ(steps(11'500), 0);
  EXPECT_EQ(steps(12'000), 1);
  EXPECT_EQ(steps(15'000), 3);
  EXPECT_EQ(steps(1'000'000), 5) << "a gap";
  EXPECT_EQ(steps(1'001'000), 1);
  EXPECT_EQ(steps(0), 0) << "a restarted server";
  EXPECT_EQ(steps(1'000), 1);
}

TEST(HeldTool, OfAJumpIsDraggedAtItsSpeedWithoutAForce) {
  Floor floor;
  HeldTool tool({.max_speed = 0.5}, floor.engine());
  double most = 0;
  for (int i = 0; i < 500; ++i) {
    DeviceState hand;
    hand.sampled = PeerTime(microseconds(1000 * i));
    hand.position = Vec3(0.1, 0, 0);
    most = std::max(most, tool.answer(hand).force.norm());
    EXPECT_LT(floor.now.velocity.head<3>().norm(), 0.75);
  }
  EXPECT_NEAR(floor.now.position.x(), 0.1, 1e-6);
  EXPECT_LT(most, 12) << "100 N without the limit";
}

TEST(HeldTool, SendsNoForceWhenTheEngineFailsAndIsFeltAfterwards) {
  Floor floor;
  HeldTool tool({}, floor.engine());
  press(tool, Vec3(0, 0, -0.013));
  floor.fails = true;
  EXPECT_FALSE(press(tool, Vec3(0, 0, -0.013)).force.allFinite());
  floor.fails = false;
  const Touch touch = press(tool, Vec3(0, 0, -0.013));
  EXPECT_NEAR(touch.force.z(), 3, 0.06);
}

TEST(HeldTool, AHandThatIsNowhereDoesNotMoveIt) {
  Floor floor;
  HeldTool tool({}, floor.engine());
  press(tool, Vec3::Zero());
  const int steps = floor.steps;
  DeviceState hand;
  hand.sampled = PeerTime(std::chrono::hours(1));
  hand.position.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(tool.answer(hand).force.allFinite());
  EXPECT_EQ(floor.steps, steps);
  EXPECT_LT(press(tool, Vec3::Zero()).force.norm(), 1e-6);
}

TEST(HeldTool, RefusesATooLightToolAndWrongNumbers) {
  Floor floor;
  const auto said = [&](const HeldTool::Config& config, const auto& change) {
    ToolEngine engine = floor.engine();
    change(engine);
    return thrown_by([&] { HeldTool(config, engine); });
  };
  const auto none = [](ToolEngine&) {};
  EXPECT_EQ(said({}, none), "");
  EXPECT_EQ(said({}, [](ToolEngine& engine) { engine.mass = 0.001; }),
            "mass = 0.001: expected more than the stiffness of its coupling times step_s², 0.001");
  EXPECT_EQ(said({}, [](ToolEngine& engine) { engine.inertia = 1e-6; }),
            "inertia = 1e-06: expected more than the stiffness of its coupling times step_s², 2e-06");
  EXPECT_NE(said({}, [](ToolEngine& engine) { engine.step_s = 0; }), "");
  EXPECT_NE(said({.stiffness = -1}, none), "");
  EXPECT_EQ(said({.max_speed = 0}, none), "max_speed = 0: expected a finite number above 0");
  EXPECT_EQ(said({.max_steps = 0}, none), "max_steps = 0: expected at least 1");
}

}  // namespace
}  // namespace tendon::held_tool_test
