// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_force.h"

#include <gtest/gtest.h>

#include <limits>

namespace tendon::bridge::vrpn::vrpn_force_test {
namespace {

constexpr double kStiffest = 2000;

Touch felt(Drawing& drawing, const Vec3& at, const Vec3& velocity = Vec3::Zero()) {
  return drawing.touch({at, velocity}, kStiffest);
}

ForceField some_field() {
  ForceField field{.origin = Vec3(0.01, 0.02, 0.03), .force = Vec3(1, 2, 3), .radius = 0.05};
  field.jacobian << -100, 10, 20, 30, -200, 40, 50, 60, -300;
  return field;
}

TEST(VrpnField, IsItsForceAndItsJacobianWithinItsRadius) {
  Drawing drawing;
  const ForceField field = some_field();
  drawing.draw(field);
  const Vec3 away(0.01, -0.02, 0.03);
  const Touch touch = felt(drawing, field.origin + away);
  EXPECT_TRUE(touch.force.isApprox(field.force + field.jacobian * away, 1e-12));
  EXPECT_EQ(touch.stiffness.value(), Mat3(-field.jacobian));
  EXPECT_NEAR(touch.valid_radius, 0.05 - away.norm(), 1e-12);
  EXPECT_FALSE(touch.contact);
  const Touch outside = felt(drawing, field.origin + Vec3(0, 0.0501, 0));
  EXPECT_TRUE(outside.force.isZero(0));
  EXPECT_FALSE(outside.stiffness);
}

TEST(VrpnField, ThatIsAllZerosEndsItAndTheNewestReplacesTheOneBefore) {
  Drawing drawing;
  drawing.draw(some_field());
  drawing.draw(ForceField{.force = Vec3(-1, 0, 0), .radius = 1});
  EXPECT_EQ(felt(drawing, Vec3::Zero()).force, Vec3(-1, 0, 0));
  EXPECT_FALSE(drawing.empty());
  drawing.draw(ForceField{.radius = 1});
  EXPECT_TRUE(drawing.empty());
  EXPECT_TRUE(felt(drawing, Vec3::Zero()).force.isZero(0));
}

TEST(VrpnPlane, PushesOutAlongItsNormalOnlyAndAnyLengthOfItIsTheSame) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const Vec3 normal = sign * Vec3::Unit(axis);
      for (const double length : {1.0, 0.1, 7.0}) {
        Drawing drawing;
        // The hand is outside if n·x + d > 0. This hand is 10 mm outside along the normal.
        ASSERT_TRUE(drawing.draw(Plane{.normal = length * normal, .offset = -0.01 * length, .spring = 0.5}));
        const Touch touch = felt(drawing, 0.008 * normal + Vec3(0.1, 0.2, 0.3) - 0.1 * (axis == 0) * Vec3::UnitX() -
                                              0.2 * (axis == 1) * Vec3::UnitY() - 0.3 * (axis == 2) * Vec3::UnitZ());
        EXPECT_TRUE(touch.force.isApprox(0.5 * kStiffest * 0.002 * normal, 1e-9)) << touch.force.transpose();
        EXPECT_TRUE(touch.stiffness.value().isApprox(0.5 * kStiffest * normal * normal.transpose(), 1e-9));
        ASSERT_TRUE(touch.contact);
        EXPECT_TRUE(touch.contact->normal.isApprox(normal, 1e-12));
        EXPECT_NEAR(touch.contact->gap, -0.002, 1e-12);
        EXPECT_TRUE(felt(drawing, 0.0101 * normal).force.isZero(0)) << "outside";
      }
    }
  }
}

TEST(VrpnPlane, TheNormalZeroEndsItWhateverItsOffset) {
  Drawing drawing;
  EXPECT_TRUE(drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1, .index = 3}));
  EXPECT_FALSE(drawing.empty());
  EXPECT_TRUE(drawing.draw(Plane{.offset = 0.5, .index = 3}));
  EXPECT_TRUE(drawing.empty());
  EXPECT_FALSE(drawing.draw(Plane{.normal = Vec3::UnitY(), .index = 4}));
  EXPECT_FALSE(drawing.draw(Plane{.normal = Vec3::UnitY(), .index = -1}));
  EXPECT_TRUE(drawing.empty());
}

TEST(VrpnPlane, ItsSpringIsAShareOfTheStiffestBetweenZeroAndOne) {
  for (const auto& [spring, share] : {std::pair{-1.0, 0.0}, {0.0, 0.0}, {0.8, 0.8}, {1.0, 1.0}, {1000.0, 1.0}}) {
    Drawing drawing;
    drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = spring});
    EXPECT_NEAR(felt(drawing, Vec3(0, -0.001, 0)).force.y(), share * kStiffest * 0.001, 1e-12) << spring;
  }
}

TEST(VrpnPlane, TwoOfThemAddUpAndAreNoContact) {
  Drawing drawing;
  drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1, .index = 0});
  drawing.draw(Plane{.normal = Vec3::UnitX(), .spring = 0.5, .index = 2});
  const Touch touch = felt(drawing, Vec3(-0.001, -0.002, 0));
  EXPECT_TRUE(touch.force.isApprox(Vec3(1, 4, 0), 1e-9));
  EXPECT_TRUE(touch.stiffness.value().isApprox(Mat3(Vec3(1000, 2000, 0).asDiagonal()), 1e-9));
  EXPECT_FALSE(touch.contact) << "it would cut the other one's push";
  EXPECT_TRUE(felt(drawing, Vec3(0.001, -0.002, 0)).contact) << "alone";
}

TEST(VrpnPlane, DampingBelowATenthIsIgnoredAndNeverMakesAPlanePull) {
  Drawing drawing;
  drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1, .damping = 0.005});
  EXPECT_EQ(felt(drawing, Vec3(0, -0.001, 0), Vec3(0, -1, 0)).force.y(), 2);
  drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1, .damping = 2});
  EXPECT_EQ(felt(drawing, Vec3(0, -0.001, 0), Vec3(0.5, -1, 0)).force, Vec3(0, 4, 0)) << "going in";
  EXPECT_EQ(felt(drawing, Vec3(0, -0.001, 0), Vec3(0, 5, 0)).force.y(), 0) << "coming out fast";
}

TEST(VrpnPlane, FrictionSticksAtTheStaticCoefficientAndSlipsAtTheOther) {
  Drawing drawing;
  drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1, .dynamic_friction = 0.2, .static_friction = 0.5});
  constexpr double kPressure = 2;  // N
  const auto along = [&](double mm) { return felt(drawing, Vec3(mm / 1000, -0.001, 0)).force.x(); };
  EXPECT_EQ(along(0), 0);
  EXPECT_NEAR(along(0.1), -0.5 * kPressure * 0.5, 1e-9) << "half of the bristle's way";
  EXPECT_NEAR(along(0.199), -0.5 * kPressure * 0.995, 1e-9);
  EXPECT_NEAR(along(0.25), -0.2 * kPressure, 1e-9) << "it slips";
  EXPECT_NEAR(along(5), -0.2 * kPressure, 1e-9);
  EXPECT_NEAR(along(5), -0.2 * kPressure, 1e-9) << "asked again for one state, it answers the same";
  EXPECT_NEAR(along(4.92), 0, 1e-9) << "the hand turns back: the bristle straightens";
  EXPECT_NEAR(along(4.82), 0.5 * kPressure * 0.5, 1e-9) << "and sticks the other way";
  felt(drawing, Vec3(0, 0.001, 0));
  EXPECT_EQ(along(9), 0) << "a new touch, a new foot";
}

TEST(VrpnForce, IsTurnedIntoTheDevicesOwnFrame) {
  // The x axis of the device points up, y points to the user, and z points to the right.
  const View view(*find_frame("openhaptics"), quaternion_of(operator_from_device("right=z up=x user=y")));
  Drawing drawing;
  drawing.draw(Plane{.normal = Vec3::UnitY(), .spring = 1});
  const Touch touch = in_base_frame(felt(drawing, Vec3(0, -0.001, 0)), view);
  EXPECT_TRUE(touch.force.isApprox(Vec3(2, 0, 0), 1e-9)) << "up";
  EXPECT_TRUE(touch.stiffness.value().isApprox(Mat3(Vec3(2000, 0, 0).asDiagonal()), 1e-9));
  EXPECT_TRUE(touch.contact->normal.isApprox(Vec3::UnitX(), 1e-12));
}

}  // namespace
}  // namespace tendon::bridge::vrpn::vrpn_force_test
