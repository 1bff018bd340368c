// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/scripted_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::scripted_motion_test {
namespace {

using namespace std::chrono_literals;
using Recorded = ScriptedMotion::Recorded;

Recorded bumpy(Recorded::AtEnd at_end) {
  Recorded motion;
  motion.at_end = at_end;
  motion.direction = {0, 0, -4};
  motion.samples = {{5.0, 0.01}, {5.1, 0.02}, {5.15, 0.02}, {5.4, -0.03}, {5.5, -0.031}, {5.9, 0.01}};
  return motion;
}

std::vector<std::pair<std::string, ScriptedMotion>> all_kinds() {
  return {
      {"sine", ScriptedMotion(ScriptedMotion::Sine{
                   .amplitude = 0.02, .frequency = 1.3, .centre = {1, 2, 3}, .direction = {1, 1, 0}})},
      {"ramp, to and fro",
       ScriptedMotion(ScriptedMotion::RampHold{.from = {0, 0, 1}, .to = {0.1, 0, 0}, .ramp = 300ms, .hold = 200ms})},
      {"ramp, once",
       ScriptedMotion(ScriptedMotion::RampHold{.from = {0, 0, 1}, .to = {0.1, 0, 0}, .ramp = 300ms, .hold = {}})},
      {"minimum jerk, to and fro",
       ScriptedMotion(ScriptedMotion::MinimumJerk{.points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.05, 0.02}},
                                                  .durations = {400ms, 700ms}})},
      {"minimum jerk, once",
       ScriptedMotion(ScriptedMotion::MinimumJerk{.points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.05, 0.02}},
                                                  .durations = {400ms, 700ms},
                                                  .back_and_forth = false})},
      {"recorded, held", ScriptedMotion(bumpy(Recorded::AtEnd::kHold))},
      {"recorded, repeated", ScriptedMotion(bumpy(Recorded::AtEnd::kRepeat))},
  };
}

TEST(ScriptedMotion, HasTheVelocityThatIsTheDerivativeOfItsPosition) {
  for (const auto& [name, motion] : all_kinds()) {
    const double h = 1e-6;
    // These times avoid the corners of the ramps.
    for (double t = 0.0037; t < 3; t += 0.00713) {
      const Vec3 difference = (motion.at(t + h).position - motion.at(t - h).position) / (2 * h);
      ASSERT_LT((motion.at(t).velocity - difference).norm(), 1e-6) << name << " at " << t;
    }
  }
}

TEST(Sine, SwingsAboutItsCentreAlongItsDirectionWhateverThatVectorsLength) {
  const ScriptedMotion motion(
      ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 2, .centre = {1, 2, 3}, .direction = {0, 30, -40}});
  EXPECT_EQ(motion.at(0).position, Vec3(1, 2, 3));
  EXPECT_LT((motion.at(0.125).position - Vec3(1, 2.012, 2.984)).norm(), 1e-15);
  EXPECT_NEAR(motion.at(0).velocity.norm(), 0.02 * 4 * std::numbers::pi, 1e-15);
}

TEST(Guided, IsWhereItsPointIsNow) {
  ScriptedMotion::Point point{.position = {1, 2, 3}, .velocity = {4, 5, 6}};
  const ScriptedMotion motion(ScriptedMotion::Guided{&point});
  point.position.x() = 7;
  EXPECT_EQ(motion.at(0).position, Vec3(7, 2, 3));
  EXPECT_EQ(motion.at(0).velocity, Vec3(4, 5, 6));
  EXPECT_THROW(ScriptedMotion(ScriptedMotion::Guided{}), std::invalid_argument);
}

TEST(RampHold, HoldsAtBothEndsForAsLongAsItWasTold) {
  const ScriptedMotion motion(
      ScriptedMotion::RampHold{.from = {0, 0, 0}, .to = {0.1, 0, 0}, .ramp = 300ms, .hold = 200ms});
  EXPECT_EQ(motion.at(0).position.x(), 0);
  EXPECT_NEAR(motion.at(0.15).position.x(), 0.05, 1e-15);
  EXPECT_NEAR(motion.at(0.15).velocity.x(), 0.1 / 0.3, 1e-15);
  for (const double t : {0.31, 0.49}) EXPECT_EQ(motion.at(t).position.x(), 0.1) << t;
  for (const double t : {0.31, 0.49, 0.81, 0.99}) EXPECT_EQ(motion.at(t).velocity.norm(), 0) << t;
  EXPECT_NEAR(motion.at(0.65).position.x(), 0.05, 1e-15);
  for (const double t : {0.81, 0.99}) EXPECT_NEAR(motion.at(t).position.x(), 0, 1e-17) << t;
  EXPECT_NEAR(motion.at(100.15).position.x(), 0.05, 1e-12);
}

TEST(RampHold, StaysAtItsEndWhenItWasNotToldHowLong) {
  const ScriptedMotion motion(
      ScriptedMotion::RampHold{.from = {0, 0, 0}, .to = {0.1, 0, 0}, .ramp = 300ms, .hold = {}});
  EXPECT_EQ(motion.at(1e6).position, Vec3(0.1, 0, 0));
  EXPECT_EQ(motion.at(1e6).velocity, Vec3::Zero());
}

TEST(MinimumJerk, IsAtEachPointOnTimeAndAtRestThere) {
  const Vec3 points[] = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.05, 0.02}};
  const ScriptedMotion motion(
      ScriptedMotion::MinimumJerk{.points = {points[0], points[1], points[2]}, .durations = {400ms, 700ms}});
  const struct {
    double t;
    Vec3 point;
  } stations[] = {{0, points[0]},   {0.4, points[1]}, {1.1, points[2]},
                  {1.8, points[1]}, {2.2, points[0]}, {2.6, points[1]}};
  for (const auto& station : stations) {
    EXPECT_LT((motion.at(station.t).position - station.point).norm(), 1e-15) << station.t;
    EXPECT_LT(motion.at(station.t).velocity.norm(), 1e-12) << station.t;
  }
  EXPECT_NEAR(motion.at(0.2).velocity.x(), 1.875 * 0.1 / 0.4, 1e-12) << "peak speed is 15/8 of the mean";
}

TEST(MinimumJerk, StaysAtTheLastPointWhenItDoesNotGoBack) {
  const ScriptedMotion motion(
      ScriptedMotion::MinimumJerk{.points = {{0, 0, 0}, {0.1, 0, 0}}, .durations = {400ms}, .back_and_forth = false});
  EXPECT_EQ(motion.at(7).position, Vec3(0.1, 0, 0));
  EXPECT_EQ(motion.at(7).velocity, Vec3::Zero());
}

TEST(Recorded, PassesThroughEverySampleOnASmoothPath) {
  const Recorded recorded = bumpy(Recorded::AtEnd::kHold);
  const ScriptedMotion motion(recorded);
  for (const auto& sample : recorded.samples) {
    const double t = sample.t - 5.0;
    EXPECT_NEAR(motion.at(t).position.z(), -sample.x, 1e-15) << t;
    EXPECT_LT((motion.at(t + 1e-9).velocity - motion.at(std::max(0.0, t - 1e-9)).velocity).norm(), 1e-6) << t;
  }
}

TEST(Recorded, NeverLeavesTheRangeOfTheTwoSamplesItIsBetween) {
  const Recorded recorded = bumpy(Recorded::AtEnd::kHold);
  const ScriptedMotion motion(recorded);
  for (std::size_t i = 1; i < recorded.samples.size(); ++i) {
    const auto& a = recorded.samples[i - 1];
    const auto& z = recorded.samples[i];
    for (double u = 0; u < 1; u += 0.01) {
      const double x = -motion.at(a.t - 5.0 + u * (z.t - a.t)).position.z();
      ASSERT_GE(x, std::min(a.x, z.x) - 1e-15);
      ASSERT_LE(x, std::max(a.x, z.x) + 1e-15);
    }
  }
}

TEST(Recorded, IsHeldAtTheEndOrPlayedAgainFromTheStart) {
  const ScriptedMotion held(bumpy(Recorded::AtEnd::kHold));
  EXPECT_EQ(held.at(50).position.z(), -0.01);
  EXPECT_EQ(held.at(50).velocity, Vec3::Zero());
  const ScriptedMotion repeated(bumpy(Recorded::AtEnd::kRepeat));
  EXPECT_LT((repeated.at(0.3).position - repeated.at(0.3 + 9 * 0.9).position).norm(), 1e-12);
}

TEST(Recorded, FollowsASmoothMotionThatWasSampledWell) {
  // The error of a slope is of second order, except near extrema. If 1 Hz is sampled at 100 Hz, it is 0.2 %.
  Recorded recorded;
  for (int i = 0; i <= 200; ++i) {
    recorded.samples.push_back({0.01 * i, std::sin(2 * std::numbers::pi * 0.01 * i)});
  }
  const ScriptedMotion motion(recorded);
  for (double t = 0.02; t < 1.98; t += 0.0013) {
    ASSERT_NEAR(motion.at(t).position.x(), std::sin(2 * std::numbers::pi * t), 2e-3);
    ASSERT_NEAR(motion.at(t).velocity.x(), 2 * std::numbers::pi * std::cos(2 * std::numbers::pi * t), 0.2);
  }
}

TEST(ScriptedMotion, RefusesImpossibleScriptsAndNamesTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::pair<ScriptedMotion::Script, std::string> cases[] = {
      {ScriptedMotion::Sine{.amplitude = -1, .frequency = 1}, "sine.amplitude = -1: expected 0 m or more"},
      {ScriptedMotion::Sine{.amplitude = 1, .frequency = nan}, "sine.frequency = nan: expected 0 Hz or more"},
      {ScriptedMotion::Sine{.amplitude = 1, .frequency = 1, .direction = {0, 0, 0}},
       "sine.direction (its length) = 0: expected a vector that is not zero"},
      {ScriptedMotion::Sine{.amplitude = 1, .frequency = 1, .centre = {0, nan, 0}}, "sine.centre.y = nan: expected"},
      {ScriptedMotion::RampHold{.ramp = 0ms, .hold = {}}, "ramp_hold.ramp = 0: expected"},
      {ScriptedMotion::RampHold{.ramp = 1ms, .hold = -1ms}, "ramp_hold.hold = -0.001: expected"},
      {ScriptedMotion::MinimumJerk{.points = {Vec3::Zero()}, .durations = {}},
       "minimum_jerk.points (their number) = 1: expected 2 or more"},
      {ScriptedMotion::MinimumJerk{.points = {Vec3::Zero(), Vec3::Zero()}, .durations = {}},
       "minimum_jerk.durations (their number) = 0: expected one fewer than points"},
      {ScriptedMotion::MinimumJerk{.points = {Vec3::Zero(), Vec3::Zero()}, .durations = {0ms}},
       "minimum_jerk.durations = 0: expected durations above 0 s"},
      {Recorded{.samples = {{0, 0}}}, "recorded.samples (their number) = 1: expected 2 or more"},
      {Recorded{.samples = {{0, 0}, {0, 1}}}, "recorded.samples.t = 0: expected a time later than"},
      {Recorded{.samples = {{0, 0}, {1, nan}}}, "recorded.samples.x = nan: expected a finite number"},
  };
  for (const auto& [script, says] : cases) {
    const std::string message = thrown_by([&, &bad = script] { const ScriptedMotion motion(bad); });
    EXPECT_TRUE(message.starts_with(says)) << message << "\nexpected: " << says;
  }
}

}  // namespace
}  // namespace tendon::scripted_motion_test
