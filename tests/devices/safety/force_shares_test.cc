// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/force_shares.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::force_shares_test {
namespace {

using namespace std::chrono_literals;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(ForceLimit, ShortensAForceAndDoesNotTurnIt) {
  const ForceLimit limit({.max = 8});
  Dice dice(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 asked = dice.direction() * dice.within(8, 30);
    const Vec3 given = asked * limit.share(asked);
    EXPECT_NEAR(given.norm(), 8, 1e-12);
    EXPECT_NEAR(given.cross(asked).norm(), 0, 1e-12 * asked.squaredNorm());
    EXPECT_GT(given.dot(asked), 0);
  }
}

TEST(ForceLimit, LeavesAShorterForceWholeAndGivesNothingOfWhatIsNoNumber) {
  const ForceLimit limit({.max = 8});
  EXPECT_EQ(limit.share({4, -4, 5}), 1);
  EXPECT_EQ(limit.share(Vec3::Zero()), 1);
  EXPECT_EQ(limit.share({kNaN, 0, 0}), 0);
  EXPECT_EQ(limit.share({std::numeric_limits<double>::infinity(), 0, 0}), 0);
}

TEST(GrowthLimit, LetsAForceGrowAlongItselfAtItsRate) {
  const GrowthLimit limit({.rate = 500});
  const Vec3 asked(3, 0, -4);
  Vec3 held = Vec3::Zero();
  for (int ms = 1; ms <= 20; ++ms) {
    held = asked * limit.share(asked, held, 1ms);
    EXPECT_NEAR(held.norm(), std::min(5.0, 0.5 * ms), 1e-12);
    EXPECT_NEAR(held.cross(asked).norm(), 0, 1e-12);
  }
}

TEST(GrowthLimit, LetsAForceFallAtOnce) {
  const GrowthLimit limit({.rate = 1});
  EXPECT_EQ(limit.share({1, 0, 0}, {8, 0, 0}, 1ms), 1);
  EXPECT_EQ(limit.share(Vec3::Zero(), {8, 0, 0}, 1ms), 1);
}

TEST(GrowthLimit, AReversedForceBeginsAtZeroATurnedOneKeepsItsShare) {
  const GrowthLimit limit({.rate = 100});
  EXPECT_NEAR(limit.share({-5, 0, 0}, {5, 0, 0}, 1ms) * 5, 0.1, 1e-12);
  EXPECT_NEAR(limit.share({0, 5, 0}, {5, 0, 0}, 1ms) * 5, 0.1, 1e-12);
  const Vec3 turned(5 * std::cos(0.1), 5 * std::sin(0.1), 0);
  EXPECT_NEAR(limit.share(turned, {5, 0, 0}, 0ms) * 5, 5 * std::cos(0.1), 1e-12);
}

TEST(RampIn, GoesFromNothingToAllInItsTime) {
  const RampIn ramp({.time = 200ms});
  EXPECT_EQ(ramp.share(0ms), 0);
  EXPECT_DOUBLE_EQ(ramp.share(50ms), 0.25);
  EXPECT_EQ(ramp.share(200ms), 1);
  EXPECT_EQ(ramp.share(10s), 1);
}

TEST(RampOut, GoesFromAllToNothingInItsTimeOrAtOnce) {
  const LocalTime since{1s};
  const RampOut ramp{since, 20ms};
  EXPECT_EQ(ramp.share(since), 1);
  EXPECT_DOUBLE_EQ(ramp.share(since + 5ms), 0.75);
  EXPECT_EQ(ramp.share(since + 20ms), 0);
  EXPECT_EQ(ramp.share(since + 1h), 0);
  EXPECT_EQ((RampOut{since, 0ms}).share(since), 0);
}

constexpr HeatLimit::Config kTouch = {.peak = 3.3, .continuous = 0.88, .time_constant = 30s};

TEST(HeatLimit, HeatsAsAFirstOrderSystemHoweverTheTimeIsCut) {
  HeatLimit fine(kTouch);
  HeatLimit coarse(kTouch);
  for (int ms = 0; ms < 700; ++ms) fine.observe(2, 1ms);
  for (int i = 0; i < 7; ++i) coarse.observe(2, 100ms);
  const double load = 2 / 0.88;
  const double exact = load * load * (1 - std::exp(-0.7 / 30));
  EXPECT_NEAR(fine.heat(), exact, 1e-12);
  EXPECT_NEAR(coarse.heat(), exact, 1e-12);
  EXPECT_EQ(fine.bound(), 3.3) << "cool motors have all their force";
}

TEST(HeatLimit, FallsByAThousandthOfTheRestEachMillisecondWhileWarm) {
  HeatLimit limit(kTouch);
  while (limit.heat() <= 0.7) limit.observe(3.3, 1ms);
  double bound = limit.bound();
  for (int ms = 0; ms < 500; ++ms) {
    limit.observe(limit.bound(), 1ms);
    ASSERT_LT(limit.heat(), 1);
    EXPECT_NEAR((limit.bound() - 0.88) / (bound - 0.88), 0.999, 1e-6);
    bound = limit.bound();
  }
  EXPECT_NEAR(limit.share({5, 0, 0}) * 5, bound, 1e-12);
}

TEST(HeatLimit, GivesThePeakBackOnlyWhenCool) {
  HeatLimit limit(kTouch);
  while (limit.heat() <= 0.95) limit.observe(3.3, 1ms);
  const auto rest_until = [&limit](double heat) {
    while (limit.heat() > heat) limit.observe(0, 1ms);
    return limit.bound();
  };
  const double warm = rest_until(0.7);
  EXPECT_LT(warm, 1);
  EXPECT_EQ(rest_until(0.5001), warm) << "neither warm nor cool: it stays";
  EXPECT_GT(rest_until(0.45), warm + 1);
  EXPECT_NEAR(rest_until(0.1), 3.3, 1e-6);
}

TEST(HeatLimit, NeverGetsWarmerThanTheContinuousForceMakesItWhateverIsAsked) {
  Dice dice(3);
  for (int run = 0; run < 20; ++run) {
    HeatLimit::Config config = kTouch;
    config.time_constant = from_seconds(dice.decades(-1, 2));
    HeatLimit limit(config);
    const double step = 1e-3 / seconds(config.time_constant) * (3.3 / 0.88) * (3.3 / 0.88);
    double hottest = 0;
    for (int ms = 0; ms < 20'000; ++ms) {
      const Vec3 asked(ms % 4000 < 3500 ? 10 : dice.within(0, 1), 0, 0);
      limit.observe((asked * limit.share(asked)).norm(), 1ms);
      hottest = std::max(hottest, limit.heat());
    }
    EXPECT_LE(hottest, 1 + step);
    if (config.time_constant < 2s) {
      EXPECT_GT(hottest, 0.7);
    }
  }
}

TEST(HeatLimit, NeverTouchesWhatTheMotorsBearForEver) {
  HeatLimit limit(kTouch);
  for (int s = 0; s < 1000; ++s) {
    limit.observe(0.88, 1s);
    ASSERT_EQ(limit.share({0.88, 0, 0}), 1);
  }
}

Workspace sphere() {
  return Workspace({.centre = {0, 0, 0.1}, .shape = Workspace::Sphere{.radius = 0.04}, .margin = 0.01});
}
Workspace box() {
  return Workspace({.centre = {0, 0, 0.1}, .shape = Workspace::Box{.half = {0.05, 0.04, 0.03}}, .margin = 0.01});
}

TEST(Workspace, LeavesEveryForceWholeInside) {
  Dice dice(4);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 inside = Vec3(0, 0, 0.1) + dice.direction() * dice.within(0, 0.0299);
    EXPECT_EQ(sphere().share(dice.direction() * 5, inside), 1);
    EXPECT_EQ(box().share(dice.direction() * 5, inside), 1);
  }
}

TEST(Workspace, TakesAsMuchOfAForceThatPushesOutAsTheHandIsBeyondTheEdge) {
  const Vec3 out = Vec3(1, 2, -2) / 3;
  for (const double depth : {0.0, 0.0025, 0.0075, 0.01, 0.03}) {
    const double left = 1 - std::min(1.0, depth / 0.01);
    EXPECT_NEAR(sphere().share(7 * out, Vec3(0, 0, 0.1) + out * (0.04 + depth)), left, 1e-12);
    EXPECT_NEAR(box().share({7, 0, 0}, {0.05 + depth, 0.01, 0.1}), left, 1e-12);
    EXPECT_NEAR(box().share({0, -7, 0}, {0.05, -0.04 - depth, 0.1}), left, 1e-12);
  }
}

TEST(Workspace, LeavesAForceWholeThatPullsTheHandBackOrAlongTheEdge) {
  const Vec3 far_out(0.2, 0, 0.1);
  for (const Workspace& workspace : {sphere(), box()}) {
    EXPECT_EQ(workspace.share({-7, 0, 0}, far_out), 1);
    EXPECT_EQ(workspace.share({-1, 5, 0}, far_out), 1);
    EXPECT_EQ(workspace.share({0, 5, -1}, far_out), 1);
    EXPECT_NEAR(workspace.share({3, 4, 0}, far_out), 1 - 0.6, 1e-12) << "so much of it points outwards";
  }
}

TEST(Workspace, OfABoxTheCornerIsRoundAndTheEdgeSharp) {
  const Vec3 beyond = box().outside({0.053, 0.044, 0.1});
  EXPECT_NEAR((beyond - Vec3(0.003, 0.004, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(box().outside({0.05, 0.04, 0.13}), Vec3::Zero());
}

TEST(Workspace, HasNoStepsAnywhere) {
  Dice dice(5);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 at = Vec3(0, 0, 0.1) + dice.direction() * dice.within(0.02, 0.09);
    const Vec3 asked = dice.direction() * 5;
    const Vec3 moved = at + dice.direction() * 1e-7;
    for (const Workspace& workspace : {sphere(), box()}) {
      const double share = workspace.share(asked, at);
      ASSERT_GE(share, 0);
      ASSERT_LE(share, 1);
      // The tolerance is relative to the margin of 10 mm and the outward direction, which varies near the edge.
      ASSERT_NEAR(workspace.share(asked, moved), share, 1e-4);
    }
  }
}

TEST(ForceShares, RefuseImpossibleValuesNamingTheField) {
  const auto refused = [](const char* field, const auto& make) {
    const std::string message = thrown_by(make);
    EXPECT_NE(message.find(field), std::string::npos) << message << "\nexpected: " << field;
  };
  for (const double bad : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
    refused("force_limit.max", [bad] { ForceLimit({.max = bad}); });
    refused("growth_limit.rate", [bad] { GrowthLimit({.rate = bad}); });
    refused("heat_limit.continuous", [bad] { HeatLimit({.peak = 8, .continuous = bad, .time_constant = 1s}); });
    refused("workspace.margin", [bad] { Workspace({.shape = Workspace::Sphere{.radius = 1}, .margin = bad}); });
    refused("workspace.radius", [bad] { Workspace({.shape = Workspace::Sphere{.radius = bad}, .margin = 1}); });
    refused("workspace.half", [bad] { Workspace({.shape = Workspace::Box{.half = {1, bad, 1}}, .margin = 1}); });
  }
  refused("ramp_in.time", [] { RampIn({.time = 0ms}); });
  refused("heat_limit.peak", [] { HeatLimit({.peak = 0.5, .continuous = 0.88, .time_constant = 1s}); });
  refused("heat_limit.time_constant", [] { HeatLimit({.peak = 2, .continuous = 0.88, .time_constant = 0s}); });
  refused("workspace.centre", [] {
    Workspace({.centre = {kNaN, 0, 0}, .shape = Workspace::Sphere{.radius = 1}, .margin = 1});
  });
}

}  // namespace
}  // namespace tendon::force_shares_test
