// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/identification/integral_fit.h"
#include "core/identification/kelly_fit.h"
#include "tests/core/identification/exact_ramp.h"

namespace tendon::fits_test {
namespace {

using testing::ExactRamp;

constexpr double kStep = 3e-5;
constexpr double kMass = 0.075;

Slide slide(const ExactRamp& ramp) { return slide_of(ramp.run(), ramp.encoder_step); }

TEST(KellyFit, IsRightOnALongSlide) {
  for (const double rate : {0.02, 0.05}) {
    const KellyFit fit = kelly_fit(slide({.rate = rate, .viscous = 1, .travel = 1}), kMass);
    EXPECT_NEAR(fit.friction.viscous, 1, 0.002);
    EXPECT_NEAR(fit.friction.coulomb, 0.05, 0.0005);
    EXPECT_TRUE(fit.plausible());
  }
}

TEST(KellyFit, DoesNotCareWhenTheClockStarted) {
  RampRun run = ExactRamp{}.run();
  const KellyFit fit = kelly_fit(slide_of(run, kStep), kMass);
  for (RampSample& sample : run.samples) sample.t += 1000;
  const KellyFit later = kelly_fit(slide_of(run, kStep), kMass);
  EXPECT_NEAR(later.friction.viscous, fit.friction.viscous, 1e-6);
  EXPECT_NEAR(later.friction.coulomb, fit.friction.coulomb, 1e-6);
}

TEST(KellyFit, OnADesktopSeesTheFrictionThatTheSpecSays) {
  // 0.25 m of travel, f_c = 0.05 N. The expected value is for a fit to velocities; kelly_fit uses positions (5 %).
  struct Row {
    double viscous, rate, kelly_viscous, kelly_coulomb;
  };
  for (const Row& row : {Row{0.26, 0.05, 0.262, 0.050}, Row{0.26, 0.1, 0.266, 0.048}, Row{0.26, 0.5, 0.302, 0.023},
                         Row{0.05, 0.05, 0.095, 0.035}, Row{0.05, 0.5, 0.176, -0.047}, Row{0.005, 0.05, 0.074, 0.025},
                         Row{0.005, 0.1, 0.092, 0.009}, Row{0.005, 0.5, 0.156, -0.071}}) {
    const KellyFit fit = kelly_fit(slide({.rate = row.rate, .viscous = row.viscous}), kMass);
    EXPECT_NEAR(fit.friction.viscous / row.kelly_viscous, 1, 0.05) << row.viscous << " " << row.rate;
    EXPECT_NEAR(fit.friction.coulomb, row.kelly_coulomb, 0.003) << row.viscous << " " << row.rate;
  }
}

TEST(KellyFit, KnowsThatItIsNotLongEnough) {
  EXPECT_TRUE(kelly_fit(slide({.rate = 0.05, .viscous = 0.26}), kMass).long_enough());
  EXPECT_FALSE(kelly_fit(slide({.rate = 0.5, .viscous = 0.26}), kMass).long_enough());
  for (const double rate : {0.05, 0.1, 0.5}) {
    EXPECT_FALSE(kelly_fit(slide({.rate = rate, .viscous = 0.05}), kMass).long_enough()) << rate;
    EXPECT_FALSE(kelly_fit(slide({.rate = rate, .viscous = 0.005}), kMass).long_enough()) << rate;
  }
}

struct Case {
  double viscous;
  double rate;
};
class IntegralFitOf : public ::testing::TestWithParam<Case> {};

TEST_P(IntegralFitOf, AnySlideFindsTheFrictionKnowingTheMass) {
  const auto [viscous, rate] = GetParam();
  const IntegralFit fit = integral_fit(slide({.rate = rate, .viscous = viscous}), kMass);
  EXPECT_NEAR(fit.friction.viscous, viscous, 2e-4);
  EXPECT_NEAR(fit.friction.coulomb, 0.05, 1e-4);
  EXPECT_EQ(fit.mass, kMass);
}

TEST_P(IntegralFitOf, AnySlideFindsTheMassToo) {
  const auto [viscous, rate] = GetParam();
  const IntegralFit fit = integral_fit(slide({.rate = rate, .viscous = viscous}), std::nullopt);
  EXPECT_NEAR(fit.friction.viscous, viscous, 2e-3);
  EXPECT_NEAR(fit.friction.coulomb, 0.05, 1e-3);
  EXPECT_NEAR(fit.mass / kMass, 1, 0.08);
}

TEST_P(IntegralFitOf, AnySlideToleratesALateLoop) {
  const auto [viscous, rate] = GetParam();
  const ExactRamp ramp{.rate = rate, .viscous = viscous};
  // Every fifth sample is lost, and the previous force persists.
  RampRun run;
  for (std::size_t i = 0; const RampSample& sample : ramp.run().samples) {
    if (++i % 5 == 0) {
      run.samples.back().force = sample.force - rate * ramp.period / 2;
    } else {
      run.samples.push_back(sample);
    }
  }
  const IntegralFit fit = integral_fit(slide_of(run, kStep), kMass);
  EXPECT_NEAR(fit.friction.viscous, viscous, 2e-4);
  EXPECT_NEAR(fit.friction.coulomb, 0.05, 1e-4);
}

TEST_P(IntegralFitOf, AnySlideCountsNoWrongSample) {
  const auto [viscous, rate] = GetParam();
  RampRun run = ExactRamp{.rate = rate, .viscous = viscous}.run();
  for (std::size_t i = run.samples.size() / 2; i < run.samples.size() - 10; i += 37) run.samples[i].position += 0.01;
  const IntegralFit fit = integral_fit(slide_of(run, kStep), kMass);
  EXPECT_NEAR(fit.friction.viscous, viscous, 0.005);
  EXPECT_NEAR(fit.friction.coulomb, 0.05, 0.001);
}

INSTANTIATE_TEST_SUITE_P(Short, IntegralFitOf,
                         ::testing::Values(Case{0.26, 0.05}, Case{0.26, 0.5}, Case{0.05, 0.1}, Case{0.005, 0.05},
                                           Case{0.005, 0.5}, Case{1, 0.1}));

TEST(IntegralFit, RefusesAMassThatIsNone) {
  const Slide any = slide({});
  for (const double mass : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(integral_fit(any, mass), std::invalid_argument);
    EXPECT_THROW(kelly_fit(any, mass), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::fits_test
