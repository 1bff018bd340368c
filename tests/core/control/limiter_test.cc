// SPDX-License-Identifier: Apache-2.0
// core_passivity_test tests whether the limiter is passive.
#include "core/control/limiter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/dice.h"

namespace tendon::limiter_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

LimiterConfig config_of(Law law) {
  return {.law = law,
          .friction = {0.02, 0.26},
          .longest_hold = milliseconds(1),
          .max_force = 5,
          .environment_stiffness = 500};
}

TEST(Limiter, WithoutAnOverrunFollowingHoldsChangesNoBit) {
  for (const LawInfo& law : laws()) {
    LimiterConfig config = config_of(law.law);
    Limiter follows(config);
    config.follow_holds.reset();
    Limiter does_not(config);
    Dice dice(7);
    Vec3 applied = Vec3::Zero();
    for (int n = 0; n < 500; ++n) {
      const Interval<3> interval{
          .applied = applied, .dx = dice.direction() * dice.decades(-6, -3), .held = dice.milliseconds(0.2, 1)};
      follows.observe(interval);
      does_not.observe(interval);
      const Demand<3> wanted{.force = dice.direction() * dice.decades(-2, 2)};
      const LimitedForce<3> one = follows.limit(wanted);
      const LimitedForce<3> other = does_not.limit(wanted);
      ASSERT_EQ(one.force, other.force) << law.name;
      ASSERT_EQ(one.permitted, other.permitted) << law.name;
      ASSERT_EQ(follows.longest_hold(), milliseconds(1));
      applied = one.force;
    }
  }
}

TEST(Limiter, AfterALateHoldTheBoundCountsOnOneMoreLikeIt) {
  for (const Law law : {Law::kAol, Law::kAolPlus, Law::kAolPerAxis, Law::kAolBox, Law::kForceBounding}) {
    Limiter limiter(config_of(law));
    const Vec3 push(100, 0, 0);
    limiter.observe({.applied = Vec3::Zero(), .dx = Vec3(1e-3, 0, 0), .held = milliseconds(1)});
    const double before = limiter.limit({.force = push}).permitted;
    limiter.observe({.applied = Vec3::Zero(), .dx = Vec3::Zero(), .held = microseconds(1600)});
    EXPECT_EQ(limiter.longest_hold(), milliseconds(2)) << info(law).name;
    const double coulomb = law == Law::kForceBounding ? 0 : 0.02;
    const double after = limiter.limit({.force = push}).permitted;
    if (law == Law::kForceBounding) {
      EXPECT_EQ(after, 0) << "no force was held: the contact has ended";
    } else {
      EXPECT_NEAR((after - coulomb) / (before - coulomb), std::sqrt(0.5), 1e-9) << info(law).name;
    }
  }
}

TEST(Limiter, WithoutFollowingALateHoldLeavesTheBoundAsItWas) {
  LimiterConfig config = config_of(Law::kAol);
  config.follow_holds.reset();
  Limiter limiter(config);
  limiter.observe({.applied = Vec3::Zero(), .dx = Vec3(1e-3, 0, 0), .held = milliseconds(1)});
  const double before = limiter.limit({.force = Vec3(100, 0, 0)}).permitted;
  limiter.observe({.applied = Vec3::Zero(), .dx = Vec3::Zero(), .held = milliseconds(3)});
  EXPECT_EQ(limiter.limit({.force = Vec3(100, 0, 0)}).permitted, before);
  EXPECT_EQ(limiter.longest_hold(), milliseconds(1));
}

TEST(Limiter, AnUnseenIntervalRaisesTheBoundLikeASeenOne) {
  Limiter limiter(config_of(Law::kAol));
  limiter.observe_unseen(Vec3::Zero(), microseconds(1600));
  EXPECT_EQ(limiter.longest_hold(), milliseconds(2));
}

TEST(Limiter, ForcesUnderWayAreReservedForTheLongerHold) {
  LimiterConfig config = config_of(Law::kAolPlus);
  config.parts.latency_reserve.emplace().holds = 1;
  Limiter limiter(config);
  limiter.observe({.applied = Vec3::Zero(), .dx = Vec3(1e-3, 0, 0), .held = milliseconds(1)});
  const double energy = limiter.energy();
  const double under_way = limiter.limit({.force = Vec3(0.2, 0, 0)}).force.norm();
  limiter.observe({.applied = Vec3::Zero(), .dx = Vec3::Zero(), .held = microseconds(1600)});
  const double reserve = 2e-3 * std::pow(under_way - 0.02, 2) / (4 * 0.26);
  EXPECT_NEAR(limiter.limit({.force = Vec3(100, 0, 0)}).permitted,
              0.02 + 2 * std::sqrt(0.26 * (energy - reserve) / 2e-3), 1e-9);
}

}  // namespace
}  // namespace tendon::limiter_test
