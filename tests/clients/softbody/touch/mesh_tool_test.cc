// SPDX-License-Identifier: Apache-2.0
// Tools from mesh files. rigid_contact_test.cc tests the other shapes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "clients/softbody/scene.h"
#include "clients/softbody/surface/triangles.h"
#include "tests/clients/softbody/touch/pressed_by_tools.h"
#include "tests/clients/softbody/touch/surfaces.h"

namespace tendon::softbody::mesh_tool_test {
namespace {

using testing::kExact;
using testing::one;
using testing::PressedByTools;

constexpr double kMillimetre = 1e-3;
constexpr double kAround = 1e-4;  // m, the layer thickness

RigidShape spoon() {
  return RigidShape::mesh(read_surface(TENDON_SCENES "/spoon.off"), kMillimetre, 0.0006, kAround, "spoon.off");
}

RigidShape plate() {
  return RigidShape::mesh(testing::box_surface(Vec3(30, 30, 3)), kMillimetre, 0.001, kAround, "plate");
}

TEST(MeshTool, ABallOfFacetsPressesAsTheSphereThatItIs) {
  const Vec3 lever(0.004, 0, -0.03);
  const RigidShape ball = RigidShape::mesh(testing::ball(15, 96), kMillimetre, 0.001, kAround, "ball");
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByTools faceted(law, one(ball, lever));
    PressedByTools round(law, one(RigidShape::sphere(0.015), lever));
    for (const double depth : {0.002, 0.005}) {
      const Pose handle{.position = Vec3(0.006, -0.003, 0.05 + 0.015 - depth) - lever};
      const Feel expected = round.at(handle);
      const Feel found = faceted.at(handle);
      EXPECT_GT(expected.force.z(), 0.2);
      EXPECT_LT((found.force - expected.force).norm(), 0.005 * expected.force.norm()) << depth;
      EXPECT_LT((found.torque->torque - expected.torque->torque).norm(), 0.005 * lever.norm() * expected.force.norm());
      EXPECT_LT((found.stiffness - expected.stiffness).norm(), 0.01 * expected.stiffness.norm()) << depth;
      EXPECT_NEAR(found.gap, expected.gap, 3e-5);
    }
  }
}

/// The bowl of the spoon presses with its back, the handle points up.
Pose palpating(double depth, double turn) {
  const Eigen::AngleAxisd on_its_back(std::numbers::pi / 2, Vec3::UnitY());
  return {.position = Vec3(0.003, -0.004, 0.05 + 0.0038 - depth),
          .turn = (Eigen::AngleAxisd(0.3 * turn, Vec3::UnitZ()) * Eigen::AngleAxisd(-0.15 * turn, Vec3::UnitY()) *
                   on_its_back)
                      .toRotationMatrix()};
}

TEST(MeshTool, ItsStiffnessesAreTheSlopesOfForceAndTorque) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByTools pressed(law, one(spoon()), 0, kExact);
    const Pose pose = palpating(0.003, 1);
    const Feel feel = pressed.at(pose);
    const Layer::Mat6 found = testing::slopes(pressed, pose);
    const Mat3 moved = found.topLeftCorner<3, 3>();
    const Mat3 turned = found.bottomRightCorner<3, 3>();
    EXPECT_GT(feel.force.norm(), 0.2);
    EXPECT_LT((feel.stiffness - moved).norm(), 0.01 * moved.norm());
    EXPECT_LT((feel.torque->stiffness - not_negative(turned)).norm(), 0.01 * turned.norm());
  }
}

Pose stroke(double t) {
  const double angle = 2 * std::numbers::pi * t;
  Pose pose = palpating(0.001 - 0.0022 * std::cos(angle), std::sin(angle));
  pose.position.x() += 0.003 * std::sin(2 * angle);
  return pose;
}

TEST(MeshTool, AClosedWayGivesNothingAndWithFrictionEveryPointLoses) {
  PressedByTools smooth(Law::kNeoHookean, one(spoon()));
  const testing::RubbedWay without = testing::closed_way(smooth, stroke, 80);
  EXPECT_GT(without.most, 1e-4);
  EXPECT_GT(without.turning, 0.02 * without.most);
  EXPECT_LT(std::abs(without.work), 2e-3 * without.most);
  PressedByTools rough(Law::kNeoHookean, one(spoon()), 0.4);
  const testing::RubbedWay with = testing::closed_way(rough, stroke, 40);
  EXPECT_GT(with.work, 0.05 * with.most);
  EXPECT_GE(with.least, 0);
  EXPECT_GT(with.lost, 0);  // the loss of points that let go is not counted
  EXPECT_LT(with.lost, with.work);
}

TEST(MeshTool, AThinPlateThatComesFastDoesNotComeOutOnTheOtherSide) {
  const Vec3 deep(0.002, 0, 0.05 + 0.0015 - 0.006);
  PressedByTools slow(Law::kNeoHookean, one(plate()));
  for (double z = 0.053; z > deep.z(); z -= 0.0005) slow.at(Vec3(deep.x(), 0, z));
  const Feel expected = slow.at(deep);
  EXPECT_GT(expected.force.z(), 0.5);
  PressedByTools fast(Law::kNeoHookean, one(plate()));
  fast.at(Vec3(0.002, 0, 0.06));
  EXPECT_LT((fast.at(deep).force - expected.force).norm(), 1e-3 * expected.force.norm());
  EXPECT_EQ(fast.solid.inverted(fast.model.displacements()), 0);
}

TEST(MeshTool, InItsSceneTheBackOfTheBowlMeetsTheBody) {
  const Scene scene = read_scene(TENDON_SCENES "/spoon.toml");
  Body body(scene.body);
  const Mat3 not_turned = to_device(scene).transpose();
  const Vec3 lowest = lowest_of_tool(scene.body, not_turned);
  EXPECT_NEAR(lowest.z(), -0.00364, 1e-5);
  const Vec3 up = body.touch_point() - lowest;
  const Feel feel = body.touch(Pose{.position = up - Vec3(0, 0, 0.003), .turn = not_turned});
  EXPECT_GT(feel.force.z(), 0.2);
  ASSERT_TRUE(feel.torque);
  EXPECT_FALSE(body.touch(Pose{.position = up + Vec3(0, 0, 0.001), .turn = not_turned}).touching);
}

}  // namespace
}  // namespace tendon::softbody::mesh_tool_test
