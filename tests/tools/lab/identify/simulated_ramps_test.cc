// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/simulated_ramps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/identification/friction_identification.h"
#include "tests/support/refusal.h"

/// Identification with an encoder of 30 µm and 5 mN of force noise.

namespace tendon::lab::simulated_ramps_test {
namespace {

RampExperiment experiment_with(double viscous, double coulomb = 0.05) {
  RampExperiment experiment;
  experiment.device.mass = 0.075;
  experiment.device.viscous_friction = viscous;
  experiment.device.coulomb_friction = coulomb;
  experiment.device.encoder_step = 3e-5;
  return experiment;
}

constexpr IdentificationConfig kConfig{.mass = 0.075, .encoder_step = 3e-5};

TEST(SimulatedRamps, TheSameSeedGivesTheSameRunsAndAnotherOneOthers) {
  RampExperiment experiment = experiment_with(0.05);
  experiment.repeats = 1;
  const auto runs = simulated_ramps(experiment);
  ASSERT_EQ(runs.size(), 6U);
  const auto again = simulated_ramps(experiment);
  experiment.seed = 2;
  const auto other = simulated_ramps(experiment);
  EXPECT_EQ(runs[3].samples.size(), again[3].samples.size());
  EXPECT_EQ(runs[3].samples.back().position, again[3].samples.back().position);
  EXPECT_NE(runs[3].samples[runs[3].samples.size() / 2].position,
            other[3].samples[runs[3].samples.size() / 2].position);
}

TEST(SimulatedRamps, RefusesAnExperimentThatIsNone) {
  expect_refusals(experiment_with(0.05), simulated_ramps,
                  {
                      {"rate",
                       [](auto& e) {
                         e.rates = {0.1, 0};
                       }},
                      {"travel", [](auto& e) { e.travel = -1; }},
                      {"period", [](auto& e) { e.period = Duration::zero(); }},
                  });
}

TEST(SimulatedIdentification, FindsLittleFrictionAndSaysThatKellyIsOff) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RampExperiment experiment = experiment_with(0.005);
    experiment.seed = seed;
    const Identification result = identify_friction(simulated_ramps(experiment), kConfig);
    EXPECT_NEAR(result.estimate.viscous, 0.005, 0.0015);
    EXPECT_NEAR(result.estimate.coulomb, 0.05, 0.0005);
    EXPECT_LT(result.lower_bound.viscous, 0.005);
    EXPECT_GT(result.lower_bound.viscous, 0.0025);
    EXPECT_LT(result.lower_bound.coulomb, 0.05);
    EXPECT_GT(result.places.at(0).kelly.viscous, 0.05);
    EXPECT_EQ(result.trust, Trust::kIntegral);
    EXPECT_NE(result.reason.find("shorter than 4 m/b"), std::string::npos) << result.reason;
  }
}

TEST(SimulatedIdentification, PublishesNoMoreThanTheDeviceHas) {
  for (const double viscous : {0.005, 0.02, 0.05, 0.26, 1.0}) {
    RampExperiment experiment = experiment_with(viscous, 0.03);
    experiment.bias = 0.01;
    experiment.repeats = 3;
    const Identification result = identify_friction(simulated_ramps(experiment), kConfig);
    EXPECT_LE(result.lower_bound.viscous, viscous);
    EXPECT_GE(result.lower_bound.viscous, 0.95 * viscous - 0.003);
    EXPECT_LE(result.lower_bound.coulomb, 0.03);
    EXPECT_GE(result.lower_bound.coulomb, 0.028);
    EXPECT_NEAR(result.force_noise, 0.005, 0.0015);
  }
}

TEST(IntegralFit, StatesItsErrorAsItIs) {
  for (const double viscous : {0.005, 0.26}) {
    RampExperiment experiment = experiment_with(viscous);
    experiment.rates = {0.1};
    experiment.repeats = 40;
    const Identification result = identify_friction(simulated_ramps(experiment), kConfig);
    const auto n = static_cast<double>(result.runs.size());
    Friction found{};   // mean square errors
    Friction stated{};  // mean square stated errors
    for (const RunEstimate& run : result.runs) {
      found.viscous += std::pow(run.integral.friction.viscous - viscous, 2) / n;
      found.coulomb += std::pow(run.integral.friction.coulomb - 0.05, 2) / n;
      stated.viscous += std::pow(run.integral_error.viscous, 2) / n;
      stated.coulomb += std::pow(run.integral_error.coulomb, 2) / n;
    }
    EXPECT_NEAR(std::sqrt(found.viscous / stated.viscous), 1, 0.3) << viscous;
    EXPECT_NEAR(std::sqrt(found.coulomb / stated.coulomb), 1, 0.3) << viscous;
  }
}

}  // namespace
}  // namespace tendon::lab::simulated_ramps_test
