// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/kinematics.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/devices/falcon/published_geometry.h"
#include "tests/support/dice.h"

namespace tendon::falcon::kinematics_test {
namespace {

Vec3 place(Dice& dice, double radius) { return kCentre + radius * std::cbrt(dice.uniform()) * dice.direction(); }

Mat3 numeric_jacobian(const Vec3& position) {
  return published::numeric_jacobian([](const Vec3& p) { return pose_at(p)->angles; }, position);
}

TEST(FalconKinematics, AnglesAreThoseOfThePublishedHalfAngleForm) {
  Dice dice(1);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 position = place(dice, 0.05);
    const auto pose = pose_at(position);
    ASSERT_TRUE(pose);
    ASSERT_LT((pose->angles - published::angles_at(position)).cwiseAbs().maxCoeff(), 1e-9) << position.transpose();
  }
}

TEST(FalconKinematics, ForwardUndoesInverseWithinANanometreAnywhere) {
  Dice dice(2);
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 position = place(dice, 0.05);
    const auto pose = pose_at(position);
    ASSERT_TRUE(pose);
    const auto found = pose_with(pose->angles, position + 2e-4 * dice.direction());
    ASSERT_TRUE(found) << position.transpose();
    worst = std::max(worst, (found->position - position).norm());
  }
  EXPECT_LE(worst, 1e-9);
}

TEST(FalconKinematics, EveryReachablePlaceWithin60MillimetresIsFound) {
  Dice dice(3);
  int reachable = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 position = place(dice, 0.06);
    const auto pose = pose_at(position);
    if (!pose) continue;
    ++reachable;
    const auto found = pose_with(pose->angles, kCentre);
    ASSERT_TRUE(found) << position.transpose();
    ASSERT_LE((found->position - position).norm(), 1e-9) << position.transpose();
  }
  EXPECT_GT(reachable, 19'800);
}

TEST(FalconKinematics, TheJacobianIsTheDerivativeOfTheAngles) {
  Dice dice(4);
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 position = place(dice, 0.05);
    const auto pose = pose_at(position);
    ASSERT_TRUE(pose);
    worst = std::max(worst, (pose->jacobian - numeric_jacobian(position)).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst, 1e-8);  // rad/m; the values are about 20
}

// It uses sin² θ₂ instead of sin θ₂ sin θ₃. This is 60 to 94 % of the true value within the ball of 50 mm, so that a
// force along z has a lateral error of one third or more.
TEST(FalconKinematics, TheZColumnOfThePublicDriverIsTooSmallByUpTo40Percent) {
  Dice dice(5);
  double least = 1;
  double most = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 position = place(dice, 0.04);
    const Mat3 truth = numeric_jacobian(position);
    const auto pose = pose_at(position);
    ASSERT_TRUE(pose);
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const auto row = static_cast<Eigen::Index>(leg);
      const double ratio = published::wrong_z_column(position, leg) / truth(row, 2);
      least = std::min(least, ratio);
      most = std::max(most, ratio);
      ASSERT_NEAR(pose->jacobian(row, 2) / truth(row, 2), 1, 1e-6);
    }
  }
  EXPECT_NEAR(least, 0.53, 0.01);
  EXPECT_NEAR(most, 0.94, 0.01);
}

TEST(FalconKinematics, TheHomeAndTheEndsOfItsAxisAreWhereTheyWereComputed) {
  const auto height = [](std::int16_t count) {
    const auto pose = pose_with(angles_at({count, count, count}), kCentre);
    EXPECT_TRUE(pose);
    EXPECT_NEAR(pose->position.head<2>().norm(), 0, 1e-9);
    return pose->position.z();
  };
  EXPECT_NEAR(height(0), 0.1346, 5e-5);
  EXPECT_NEAR(height(-1000), 0.0896, 5e-5);
  EXPECT_NEAR(height(1000), 0.1736, 5e-5);
}

TEST(FalconKinematics, AnEncoderCountIs43MicrometresAtTheCentre) {
  const auto pose = pose_at(kCentre);
  ASSERT_TRUE(pose);
  const Mat3 metres_per_count = pose->jacobian.inverse() * published::kPerCount;
  EXPECT_NEAR(metres_per_count.colwise().norm().mean(), 43e-6, 2e-6);
}

TEST(FalconKinematics, WhatIsNowhereHasNoPose) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(pose_at({0, 0, 1}));
  EXPECT_FALSE(pose_at({0, 0, 0}));
  EXPECT_FALSE(pose_at({nan, 0, 0.12}));
  EXPECT_FALSE(pose_with({nan, 1, 1}, kCentre));
  EXPECT_FALSE(pose_with({3, -3, 3}, kCentre));
  EXPECT_FALSE(pose_with(angles_at({0, 0, 0}), {1, 1, 1}));
}

TEST(FalconKinematics, TorquesDoTheWorkOfTheForce) {
  Dice dice(6);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 position = place(dice, 0.05);
    const auto pose = pose_at(position);
    ASSERT_TRUE(pose);
    const Vec3 force = dice.within(0, 4) * dice.direction();
    const Counts counts = counts_for(*pose, force);
    const Vec3 torque = Vec3(counts[0], counts[1], counts[2]) * -1e-4;
    const Vec3 step = 1e-7 * dice.direction();
    const Vec3 turned = published::angles_at(position + step) - published::angles_at(position - step);
    // Torque resolution of each motor: 1e-4 N·m.
    ASSERT_NEAR(torque.dot(turned), force.dot(2 * step), 1e-4 * turned.cwiseAbs().sum() + 1e-14);
    ASSERT_LT((force_of(*pose, counts) - numeric_jacobian(position).transpose() * torque).norm(), 1e-6);
  }
}

TEST(FalconKinematics, OneNewtonIs252CountsAlongZAnd606Across) {
  const auto pose = pose_at(kCentre);
  ASSERT_TRUE(pose);
  const auto largest = [&](const Vec3& force) {
    const Counts counts = counts_for(*pose, force);
    return std::max({std::abs(counts[0]), std::abs(counts[1]), std::abs(counts[2])});
  };
  EXPECT_NEAR(largest(Vec3::UnitZ()), 252, 3);
  EXPECT_NEAR(largest(Vec3::UnitX()), 606, 6);
}

// If the force is saturated, its direction must not change. In the public driver, the values wrap at 16 bits.
TEST(FalconKinematics, ATooLargeForceKeepsItsDirectionAndNeverWraps) {
  Dice dice(7);
  for (int i = 0; i < 20'000; ++i) {
    const auto pose = pose_at(place(dice, 0.05));
    ASSERT_TRUE(pose);
    const Vec3 direction = dice.direction();
    const double size = dice.decades(1.5, 9);
    const Counts counts = counts_for(*pose, size * direction);
    int largest = 0;
    for (const std::int16_t count : counts) largest = std::max(largest, std::abs(count));
    ASSERT_GE(largest, kMostCounts - 1);
    ASSERT_LE(largest, kMostCounts);
    const Vec3 given = force_of(*pose, counts);
    ASSERT_GT(given.normalized().dot(direction), 1 - 1e-5) << size;
    ASSERT_LT(given.norm(), size);
  }
}

TEST(FalconKinematics, RoundingNeverMakesATorqueLarger) {
  Dice dice(8);
  for (int i = 0; i < 20'000; ++i) {
    const auto pose = pose_at(place(dice, 0.05));
    ASSERT_TRUE(pose);
    const Vec3 force = dice.within(0, 4) * dice.direction();
    const Vec3 exact = pose->jacobian.transpose().inverse() * force * 1e4;
    const Counts counts = counts_for(*pose, force);
    for (std::size_t leg = 0; leg < 3; ++leg) {
      ASSERT_LE(std::abs(counts[leg]), std::abs(exact[static_cast<Eigen::Index>(leg)]) + 1e-9);
    }
  }
}

TEST(FalconKinematics, AForceThatIsNoneGivesNone) {
  const auto pose = pose_at(kCentre);
  ASSERT_TRUE(pose);
  EXPECT_EQ(counts_for(*pose, {std::numeric_limits<double>::quiet_NaN(), 0, 0}), Counts{});
  EXPECT_EQ(counts_for(*pose, {0, std::numeric_limits<double>::infinity(), 0}), Counts{});
}

}  // namespace
}  // namespace tendon::falcon::kinematics_test
