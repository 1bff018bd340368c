// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/penalty_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "clients/cpp/engine/fd_stiffness.h"

namespace tendon::penalty_contact_test {
namespace {

SurfacePoint ball(const Vec3& position, double radius) {
  const Vec3 n = position.normalized();
  return {.distance = position.norm() - radius,
          .normal = n,
          .curvature = (Mat3::Identity() - n * n.transpose()) / position.norm()};
}

TEST(PenaltyContact, OfAPlaneIsAKelvinVoigtWall) {
  const PenaltyContact wall({.stiffness = 1000, .damping = 5});
  const Touch touch = wall.touch({.distance = -0.002, .normal = Vec3(0, 0, 2)}, Vec3(0.3, 0, -0.1));
  EXPECT_LT((touch.force - Vec3(0, 0, 1000 * 0.002 + 5 * 0.1)).norm(), 1e-12);
  ASSERT_TRUE(touch.stiffness);
  EXPECT_LT((*touch.stiffness - Mat3(Vec3(0, 0, 1000).asDiagonal())).norm(), 1e-9);
}

TEST(PenaltyContact, NeverPulls) {
  const PenaltyContact wall({.stiffness = 1000, .damping = 50});
  const Touch outside = wall.touch({.distance = 0.001, .normal = Vec3::UnitX()}, Vec3(-1, 0, 0));
  const Touch leaving = wall.touch({.distance = -0.001, .normal = Vec3::UnitX()}, Vec3(1, 0, 0));
  for (const Touch& touch : {outside, leaving}) {
    EXPECT_EQ(touch.force, Vec3::Zero());
    ASSERT_TRUE(touch.stiffness);
    EXPECT_EQ(*touch.stiffness, Mat3::Zero());
  }
}

TEST(PenaltyContact, HasTheStiffnessOfItsForceOnACurvedBody) {
  const PenaltyContact contact({.stiffness = 800});
  const Vec3 at(0.012, -0.01, 0.015);
  const auto found =
      fd_stiffness([&](const Vec3& x) { return contact.touch(ball(x, 0.03), Vec3::Zero()).force; }, at, 1e-6);
  const Touch touch = contact.touch(ball(at, 0.03), Vec3::Zero());
  ASSERT_TRUE(found && touch.stiffness);
  EXPECT_LT((*touch.stiffness - found->stiffness).norm(), 1e-5 * found->stiffness.norm());
  EXPECT_GT((touch.stiffness->eigenvalues().real() - Vec3(800, 0, 0)).norm(), 100) << "it is not that of a plane";
}

TEST(PenaltyContact, MakesNoForceOfWhatIsNoSurface) {
  const PenaltyContact contact({.stiffness = 800});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(contact.touch({.distance = nan}, Vec3::Zero()).force.allFinite());
  EXPECT_FALSE(contact.touch({.distance = -1, .normal = Vec3::Zero()}, Vec3::Zero()).force.allFinite());
  EXPECT_FALSE(contact.touch({.distance = -1}, Vec3(0, nan, 0)).force.allFinite());
  EXPECT_THROW(PenaltyContact({.stiffness = -1}), std::invalid_argument);
  EXPECT_THROW(PenaltyContact({.stiffness = nan}), std::invalid_argument);
  EXPECT_THROW(PenaltyContact({.damping = HUGE_VAL}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::penalty_contact_test
