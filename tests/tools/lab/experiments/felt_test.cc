// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/felt.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/experiments/accuracy.h"

namespace tendon::lab::felt_test {
namespace {

using softbody::BodyConfig;

Truth& truth() {
  static Truth the({.size = {0.06, 0.06, 0.03}}, {.cells = 2, .cells_for_large = 1.5});
  return the;
}

/// A few percent too stiff, otherwise the truth, and instantaneous.
std::unique_ptr<PressedEngine> good_body() {
  const PressedBlock& block = truth().block();
  BodyConfig config;
  config.shape = softbody::BlockShape{block.size, {6, 6, 3}};
  config.element = softbody::Element::kHex27Sri;
  config.material = block.material;
  config.patch_radius = block.patch_radius;
  config.reach = 0.006;
  config.middle = block.touch_point();
  return own_engine(config);
}

Route route(const std::string& profile, double compute_ms) {
  return {.there = injector::parse_profile(profile),
          .back = injector::parse_profile(profile),
          .compute = from_seconds(1e-3 * compute_ms)};
}

TEST(Felt, AQuickBodyNearByIsFeltAsItIs) {
  const auto body = good_body();
  const Felt near = felt(*body, truth(), route("base=0.05ms", 0.01), 1);
  EXPECT_LT(near.force_error, 0.06);
  EXPECT_NEAR(near.displayed, 1, 0.06);
  EXPECT_LT(near.vibration, kMostVibration);
}

TEST(Felt, TheSameBodyIsFeltWorseTheLongerAnAnswerTakes) {
  const auto body = good_body();
  double before = 0;
  for (const double ms : {0.01, 10.0, 50.0}) {
    const Felt here = felt(*body, truth(), route("base=0.05ms", ms), 1);
    EXPECT_GT(here.force_error, before) << ms;
    EXPECT_GT(here.held_error, before) << ms;
    before = here.force_error;
  }
  EXPECT_GT(before, 0.08);
}

TEST(Felt, AStiffnessThatIsSentAlongMakesUpForMostOfTheWait) {
  const auto body = good_body();
  const Felt here = felt(*body, truth(), route("base=1ms", 10), 1);
  EXPECT_LT(here.force_error, 0.7 * here.held_error);
}

// Every encoder count excites this body: its force oscillates between zero and too much, and the limiter removes half.
TEST(Felt, ABodyOfManyShortStepsKeepsUpWithTheHand) {
  const PressedBlock& block = truth().block();
  constexpr auto kModel = softbody::compared::Kind::kTensorMass;
  const Candidate candidate{kModel, softbody::Element::kHex8Sri, 4};
  softbody::compared::Config config;
  config.effects = {.density = 1000, .step = 2e-4, .inertia = true, .damping = 40};
  const auto body = compared_engine(kModel, solid_of(block, candidate, law_of(kModel), block.material),
                                    block.patch_radius, block.touch_point(), config);
  const Felt quick = felt(*body, truth(), route("base=0.05ms", 0.2), 1);
  EXPECT_GT(quick.displayed, 0.4);
  EXPECT_LT(quick.latency, 0.006);
  const Felt slow = felt(*body, truth(), route("base=0.05ms", 1), 1);
  EXPECT_LT(slow.displayed, 0.8 * quick.displayed);
}

/// Returns the forces of an engine that answers with the sample time of the motion, in ms.
std::vector<double> answered(const Route& route, std::vector<double>* asked = nullptr) {
  Experiment set;
  set.environment.force = [asked](double t, const Vec3&) {
    if (asked != nullptr) asked->push_back(1e3 * t);
    return Vec3(1e3 * t, 0, 0);
  };
  set.environment.truth = [](double, const Vec3&) { return Vec3::Zero().eval(); };
  set.environment.route = route;
  set.limiter = {.law = tendon::Law::kNone, .friction = {.coulomb = 0, .viscous = 1}};
  set.hand = PrescribedMotion{.position = [](double) { return Vec3::Zero().eval(); }, .friction = {.viscous = 1}};
  set.length = std::chrono::milliseconds(200);
  set.max_force = 1e9;
  std::vector<double> wanted;
  for (const Moment& moment : run(set)) {
    wanted.push_back(moment.step.wanted.x());
    EXPECT_EQ(moment.true_force.norm(), 0);
  }
  return wanted;
}

TEST(Routes, AForceIsAsLateAsBothWaysAndTheAnswerTogether) {
  const std::vector<double> wanted = answered(route("base=5ms", 2));
  // Sampled at 0, 2, 4 … ms: 5 ms transit, 2 ms of work, 5 ms back.
  EXPECT_EQ(wanted[11], 0);
  for (std::size_t ms = 14; ms < wanted.size(); ++ms) EXPECT_EQ(wanted[ms], ms % 2 == 0 ? ms - 12 : ms - 13) << ms;
}

TEST(Routes, AnEngineThatIsBusyTakesTheNewestAndQueuesNothing) {
  std::vector<double> asked;
  answered(route("base=1ms", 30), &asked);
  ASSERT_GE(asked.size(), 7U);
  for (std::size_t i = 2; i < asked.size(); ++i) EXPECT_EQ(asked[i] - asked[i - 1], 30);
}

TEST(Routes, WhatTheNetworkLosesIsNotAnswered) {
  std::vector<double> all;
  std::vector<double> some;
  answered(route("base=1ms", 0.1), &all);
  answered(route("base=1ms loss=50%", 0.1), &some);
  EXPECT_GT(all.size(), 190U);
  EXPECT_LT(some.size(), 0.65 * static_cast<double>(all.size()));
  EXPECT_GT(some.size(), 0.35 * static_cast<double>(all.size()));
}

TEST(Felt, TheBestAtTheHandIsQuickEnoughAndQuiet) {
  const auto point = [](double ms, double error, double vibration) {
    AccuracyPoint p{.candidate = {softbody::ModelKind::kLinear, softbody::Element::kTet4, 4}};
    p.update_ms_p50 = ms;
    p.felt = Felt{.force_error = error, .vibration = vibration};
    return p;
  };
  const std::vector<AccuracyPoint> points{point(1, 0.3, 0), point(4, 0.2, 0), point(3, 0.01, 1), point(20, 0.1, 0)};
  EXPECT_EQ(closest_at_the_hand(points, 5), &points[1]);
  EXPECT_EQ(closest_at_the_hand(points, 100), &points[3]);
  EXPECT_EQ(closest_at_the_hand(points, 0.5), nullptr);
}

}  // namespace
}  // namespace tendon::lab::felt_test
