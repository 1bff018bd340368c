// SPDX-License-Identifier: Apache-2.0
#include "core/field/field_pose.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/rotation.h"

namespace tendon::field::field_pose_test {
namespace {

using std::chrono::milliseconds;

LocalTime at_ms(int ms) { return LocalTime(milliseconds(ms)); }

TEST(FieldPose, APlaceGoesToTheObjectAndBack) {
  const Pose pose{.position = {0.1, -0.2, 0.3}, .turn = rotation_by({0.4, 0.5, -0.6})};
  const Vec3 x(0.01, 0.02, 0.03);
  EXPECT_LT((pose.to_base(pose.to_object(x)) - x).norm(), 1e-15);
}

TEST(FieldPose, IsExtrapolatedForFiftyMillisecondsAtMost) {
  FieldPose pose;
  EXPECT_FALSE(pose.known());
  ASSERT_TRUE(pose.observe({.at = at_ms(100), .velocity = {0.2, 0, 0}, .angular_velocity = {0, 0, 1}}));
  EXPECT_NEAR(pose.at(at_ms(130), 1e-3).position.x(), 0.006, 1e-12);
  EXPECT_NEAR(rotation_vector(pose.at(at_ms(130), 1e-3).turn).z(), 0.03, 1e-5);
  EXPECT_NEAR(pose.at(at_ms(150), 1e-3).position.x(), 0.01, 1e-12);
  EXPECT_NEAR(pose.at(at_ms(900), 1e-3).position.x(), 0.01, 1e-12);
  EXPECT_NEAR(pose.at(at_ms(0), 1e-3).position.x(), -0.01, 1e-12);
}

TEST(FieldPose, TheObjectDoesNotJumpAtAPose) {
  FieldPose pose;
  ASSERT_TRUE(pose.observe({.at = at_ms(0)}));
  pose.at(at_ms(0), 1e-3);
  ASSERT_TRUE(pose.observe({.at = at_ms(1), .pose = {.position = {0.01, 0, 0}, .turn = rotation_by({0.1, 0, 0})}}));
  Pose before{};
  double most = 0;
  for (int k = 1; k < 200; ++k) {
    const Pose now = pose.at(at_ms(k), 1e-3);
    most = std::max(most, (now.position - before.position).norm());
    EXPECT_LT(turn_between(before.turn, now.turn).norm(), 0.0071);
    before = now;
  }
  EXPECT_LT(most, 0.01 / 15);
  EXPECT_NEAR(before.position.x(), 0.01, 1e-6);
  EXPECT_NEAR(rotation_vector(before.turn).x(), 0.1, 1e-6);
}

TEST(FieldPose, AnImpossiblePoseIsRefused) {
  FieldPose pose;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(pose.observe({.pose = {.position = {nan, 0, 0}}}));
  EXPECT_FALSE(pose.observe({.pose = {.position = {11, 0, 0}}}));
  EXPECT_FALSE(pose.observe({.pose = {.turn = {.w = 0}}}));
  EXPECT_FALSE(pose.observe({.velocity = {1e9, 0, 0}}));
  EXPECT_FALSE(pose.observe({.angular_velocity = {0, nan, 0}}));
  EXPECT_FALSE(pose.known());
}

}  // namespace
}  // namespace tendon::field::field_pose_test
