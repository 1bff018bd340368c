// SPDX-License-Identifier: Apache-2.0
// Rigid tools that are difficult for contact solvers. models/hard_presses_test.cc has those for the patch.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "clients/softbody/fem/region.h"
#include "tests/clients/softbody/touch/pressed_by_tools.h"

namespace tendon::softbody::hard_tools_test {
namespace {

using testing::kExact;
using testing::one;
using testing::PressedByTools;

void expect_slope(PressedByTools& pressed, const Pose& handle, double share) {
  const Feel feel = pressed.at(handle);
  const Layer::Mat6 found = testing::slopes(pressed, handle);
  const Mat3 moved = found.topLeftCorner<3, 3>();
  EXPECT_LT((feel.stiffness - moved).norm(), share * moved.norm()) << handle.position.transpose();
}

TEST(HardTool, OnACornerAndBesideTheHeldRimTheStiffnessIsTheForcesOwnSlope) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByTools corner(law, one(RigidShape::sphere(0.012)), 0, kExact);
    const Pose over{.position = Vec3(0.05, 0.05, 0.05) + 0.009 * Vec3(1, 1, 1.5).normalized()};
    const Feel on_corner = corner.at(over);
    EXPECT_GT(on_corner.force.minCoeff(), 0.005);  // pushed away from the corner along each axis
    EXPECT_EQ(corner.solid.inverted(corner.model.displacements()), 0);
    expect_slope(corner, over, 0.01);

    PressedByTools rim(law, one(RigidShape::sphere(0.012)), 0, kExact);
    rim.at(Vec3(0.08, 0.003, 0.004));
    const Pose beside{.position = Vec3(0.05 + 0.010, 0.003, 0.004)};
    const Feel held = rim.at(beside);
    EXPECT_GT(held.force.x(), 0.05);
    expect_slope(rim, beside, 0.01);
  }
}

TEST(HardTool, EightMillimetresDeepIsTheSameAtOnceAndInSteps) {
  const Vec3 deep(0, 0, 0.05 + 0.02 - 0.008);
  PressedByTools at_once(Law::kCorotational, one(RigidShape::sphere(0.02)), 0, 1e-9);
  const Feel first = at_once.at(deep);
  EXPECT_GT(first.force.z(), 1);
  PressedByTools slow(Law::kCorotational, one(RigidShape::sphere(0.02)), 0, 1e-9);
  for (double depth = 0.0005; depth < 0.0095; depth += 0.0005) slow.at(Vec3(0, 0, 0.07 - depth));
  EXPECT_LT((slow.at(deep).force - first.force).norm(), 1e-6 * first.force.norm());
  expect_slope(at_once, Pose{.position = deep}, 0.01);
}

}  // namespace
}  // namespace tendon::softbody::hard_tools_test
