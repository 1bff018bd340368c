// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/pose_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/rotation.h"
#include "tests/core/control/adversary.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::pose_map_test {
namespace {

PoseMap::Config drawn(Dice& dice) {
  PoseMap::Config config;
  config.position_scale = dice.decades(-2, 2);
  config.force_scale = dice.decades(-2, 2);
  config.rotation = rotation_by(dice.direction() * dice.within(0, 3));
  for (bool& axis : config.axes) axis = dice.chance(0.6);
  if (!config.axes[0] && !config.axes[1]) config.axes[2] = true;
  return config;
}

TEST(PoseMap, AQuarterTurnAndScalesByHand) {
  // The leader's x is the follower's y. Motion is scaled by 1/5 and force by 5.
  const PoseMap map({.position_scale = 0.2, .force_scale = 5, .rotation = rotation_by(Vec3(0, 0, std::acos(-1) / 2))});
  EXPECT_LT((map.to_follower(Vec3(0.1, 0, 0.05)) - Vec3(0, 0.02, 0.01)).norm(), 1e-15);
  EXPECT_LT((map.to_leader(Vec3(0, 0.02, 0.01)) - Vec3(0.1, 0, 0.05)).norm(), 1e-15);
  EXPECT_LT((map.force_to_leader(Vec3(0, 2, 0)) - Vec3(10, 0, 0)).norm(), 1e-14);
  EXPECT_DOUBLE_EQ(map.leader_joule(), 25);
  EXPECT_DOUBLE_EQ(map.follower_joule(), 0.04);
  EXPECT_DOUBLE_EQ(map.stiffness_at_follower(400), 400);
  EXPECT_DOUBLE_EQ(PoseMap({.position_scale = 2, .force_scale = 4}).stiffness_at_follower(400), 50);
}

TEST(PoseMap, AnAxisThatIsNotCoupledIsLeftOutAtBothEnds) {
  const PoseMap map({.rotation = rotation_by(Vec3(0, 0, std::acos(-1) / 2)), .axes = {true, false, false}});
  EXPECT_LT((map.to_follower(Vec3(1, 2, 3)) - Vec3(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((map.to_leader(Vec3(1, 2, 3)) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((map.force_to_leader(Vec3(1, 2, 3)) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(map.coupled_at_leader(Vec3(1, 2, 3)), Vec3(1, 0, 0));
  EXPECT_LT((map.coupled_at_follower(Vec3(1, 2, 3)) - Vec3(0, 2, 0)).norm(), 1e-15);
}

TEST(PoseMap, ThereAndBackIsTheCoupledPart) {
  Dice dice(1);
  for (int n = 0; n < 1000; ++n) {
    const PoseMap map(drawn(dice));
    const Vec3 u = dice.direction() * dice.decades(-3, 0);
    EXPECT_LT((map.to_leader(map.to_follower(u)) - map.coupled_at_leader(u)).norm(), 1e-14);
    const Vec3 there = map.to_follower(map.to_leader(u));
    EXPECT_LT((there - map.coupled_at_follower(u)).norm(), 1e-14);
  }
}

TEST(PoseMap, PowerAtTheLeaderIsThatAtTheFollowerInItsJoules) {
  // F_l · u_l = (s_f/s_x) F_f · u_f, the invariant that energy sharing relies on.
  Dice dice(2);
  for (int n = 0; n < 1000; ++n) {
    const PoseMap map(drawn(dice));
    const Vec3 u = dice.direction();
    const Vec3 force = dice.direction();
    const double at_leader = map.force_to_leader(force).dot(u);
    const double at_follower = force.dot(map.to_follower(u));
    EXPECT_NEAR(at_leader, map.leader_joule() * at_follower, 1e-12 * map.leader_joule() * map.to_follower(u).norm());
    EXPECT_NEAR(map.leader_joule() * map.follower_joule(), 1, 1e-15);
  }
}

TEST(PoseMap, ARotationOfAlmostLengthOneIsStillARotation) {
  Quat q = rotation_by(Vec3(0.3, -0.4, 1));
  for (double* const part : {&q.w, &q.x, &q.y, &q.z}) *part *= 1.0004;
  EXPECT_NEAR(PoseMap({.rotation = q}).to_follower(Vec3(1, 2, 3)).norm(), Vec3(1, 2, 3).norm(), 1e-14);
}

TEST(PoseMap, RefusesImpossibleConfigurations) {
  expect_refusals(PoseMap::Config(), Makes<PoseMap>(),
                  {
                      {"position_scale = 0.009", [](auto& c) { c.position_scale = 0.009; }},
                      {"position_scale", [](auto& c) { c.position_scale = std::numeric_limits<double>::quiet_NaN(); }},
                      {"force_scale = 101", [](auto& c) { c.force_scale = 101; }},
                      {"rotation", [](auto& c) { c.rotation.w = 2; }},
                      {"axes",
                       [](auto& c) {
                         c.axes = {false, false, false};
                       }},
                  });
}

}  // namespace
}  // namespace tendon::pose_map_test
