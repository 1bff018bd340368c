// SPDX-License-Identifier: Apache-2.0
#include "core/identification/friction_identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "tests/core/identification/exact_ramp.h"
#include "tests/support/refusal.h"

namespace tendon::friction_identification_test {
namespace {

using testing::ExactRamp;

constexpr IdentificationConfig kConfig{.mass = 0.075, .encoder_step = 3e-5};

std::vector<RampRun> experiment(ExactRamp like) {
  std::vector<RampRun> runs;
  for (const double rate : {0.05, 0.1, 0.5}) {
    for (const double direction : {1.0, -1.0}) {
      like.rate = direction * rate;
      runs.push_back(like.run());
    }
  }
  return runs;
}

std::vector<RampRun> joined(std::vector<RampRun> runs, const std::vector<RampRun>& more) {
  runs.insert(runs.end(), more.begin(), more.end());
  return runs;
}

TEST(Identification, OnLittleFrictionBelievesTheIntegralAndSaysWhy) {
  const Identification result = identify_friction(experiment({.viscous = 0.005}), kConfig);
  EXPECT_EQ(result.trust, Trust::kIntegral);
  EXPECT_NEAR(result.estimate.viscous, 0.005, 1e-4);
  EXPECT_NEAR(result.estimate.coulomb, 0.05, 1e-4);
  EXPECT_GT(result.places.at(0).kelly.viscous, 10 * 0.005);
  EXPECT_FALSE(result.places.at(0).kelly_valid);
  EXPECT_NE(result.reason.find("shorter than 4 m/b"), std::string::npos) << result.reason;
}

TEST(Identification, BelievesBothWhereKellysTestPasses) {
  const Identification result = identify_friction(experiment({.viscous = 0.26}), kConfig);
  EXPECT_EQ(result.trust, Trust::kBoth) << result.reason;
  EXPECT_NEAR(result.places.at(0).kelly.viscous, 0.26, 0.01);
  EXPECT_NEAR(result.estimate.viscous, 0.26, 2e-4);
}

TEST(Identification, OneSlopeAloneDoesNotMakeKellyValid) {
  const std::vector<RampRun> runs = {ExactRamp{.rate = 0.05}.run(), ExactRamp{.rate = -0.05}.run()};
  const Identification result = identify_friction(runs, kConfig);
  EXPECT_EQ(result.trust, Trust::kIntegral);
  EXPECT_NE(result.reason.find("expected a second slope"), std::string::npos) << result.reason;
}

TEST(Identification, WithAWrongMassBelievesNeitherAndPublishesTheLesser) {
  const Identification result =
      identify_friction(experiment({.viscous = 0.26}), {.mass = 0.5 * 0.075, .encoder_step = 3e-5});
  ASSERT_EQ(result.trust, Trust::kNeither) << result.reason;
  const PlaceEstimate& place = result.places.at(0);
  EXPECT_LE(result.lower_bound.viscous, std::min(place.integral.viscous, place.kelly.viscous));
  EXPECT_LE(result.lower_bound.viscous, 0.262);
  EXPECT_NE(result.reason.find("mass"), std::string::npos);
}

TEST(Identification, AMassThatIsTooSmallInflatesNothingWhereKellyIsValid) {
  const Identification result =
      identify_friction(experiment({.viscous = 0.26}), {.mass = 0.7 * 0.075, .encoder_step = 3e-5});
  EXPECT_GT(result.estimate.viscous, 0.28);
  EXPECT_LT(result.lower_bound.viscous, 0.262);
}

TEST(Identification, AConstantForceCancelsBetweenTheDirections) {
  const Identification result = identify_friction(experiment({.viscous = 0.05, .bias = 0.02}), kConfig);
  EXPECT_NEAR(result.estimate.coulomb, 0.05, 1e-4);
  EXPECT_NEAR(result.estimate.viscous, 0.05, 2e-4);
  EXPECT_TRUE(result.places.at(0).both_directions);
}

TEST(Identification, WarnsThatOneDirectionMixesAConstantForceAndFriction) {
  const std::vector<RampRun> runs = {ExactRamp{.bias = -0.02}.run()};
  const Identification result = identify_friction(runs, kConfig);
  EXPECT_NEAR(result.estimate.coulomb, 0.07, 1e-4);
  EXPECT_FALSE(result.places.at(0).both_directions);
  EXPECT_TRUE(std::ranges::any_of(
      result.warnings, [](const std::string& warning) { return warning.starts_with("only one direction"); }));
}

TEST(Identification, TheLeastFrictionOfAllPlacesCounts) {
  const auto runs = joined(joined(experiment({.viscous = 0.05, .coulomb = 0.04, .place = "x"}),
                                  experiment({.viscous = 0.03, .coulomb = 0.06, .place = "y, elbow bent"})),
                           experiment({.viscous = 0.08, .coulomb = 0.05, .place = "z"}));
  const Identification result = identify_friction(runs, kConfig);
  ASSERT_EQ(result.places.size(), 3U);
  EXPECT_EQ(result.places.at(1).place, "y, elbow bent");
  EXPECT_NEAR(result.estimate.viscous, 0.03, 2e-4);
  EXPECT_NEAR(result.estimate.coulomb, 0.04, 2e-4);
  EXPECT_LE(result.lower_bound.viscous, result.estimate.viscous);
  EXPECT_LE(result.lower_bound.coulomb, result.estimate.coulomb);
}

TEST(Identification, RunsThatDoNotAgreeWidenTheBound) {
  const auto alike = experiment({.viscous = 0.05});
  const auto runs = joined(alike, experiment({.viscous = 0.07}));
  const Identification result = identify_friction(runs, kConfig);
  EXPECT_LT(result.lower_bound.viscous, 0.05);
  EXPECT_GT(identify_friction(alike, kConfig).lower_bound.viscous, 0.0495);
}

TEST(Identification, FindsTheMassWhenNobodyKnowsIt) {
  const Identification result = identify_friction(experiment({.viscous = 0.05}), {.mass = {}, .encoder_step = 3e-5});
  EXPECT_NEAR(result.mass, 0.075, 1e-3);
  EXPECT_NEAR(result.estimate.viscous, 0.05, 5e-4);
}

TEST(Identification, NeverPublishesNegativeFriction) {
  const Identification result =
      identify_friction(experiment({.viscous = 0.005, .coulomb = 0.001}), {.mass = 0.15, .encoder_step = 3e-5});
  EXPECT_GE(result.lower_bound.viscous, 0);
  EXPECT_GE(result.lower_bound.coulomb, 0);
}

TEST(Identification, NamesTheRunThatItCannotUse) {
  std::vector<RampRun> runs = experiment({});
  runs.at(2).samples.resize(10);
  EXPECT_EQ(thrown_by([&] { identify_friction(runs, kConfig); }),
            "run 3: expected a run of 50 samples or more, found 10");
  EXPECT_THROW(identify_friction({}, kConfig), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::friction_identification_test
