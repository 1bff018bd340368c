// SPDX-License-Identifier: Apache-2.0
#include "core/identification/ramp_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/core/identification/exact_ramp.h"
#include "tests/support/refusal.h"

namespace tendon::ramp_run_test {
namespace {

using testing::ExactRamp;

constexpr double kStep = 3e-5;

std::string error_of(const RampRun& run, double encoder_step = kStep) {
  return thrown_by([&] { slide_of(run, encoder_step); });
}

TEST(Slide, BeginsFiveCountsAfterBreakAway) {
  const Slide slide = slide_of(ExactRamp{}.run(), kStep);
  EXPECT_GT(slide.samples.front().position, 5 * kStep);
  EXPECT_LT(slide.samples.front().position, 8 * kStep);
  EXPECT_GT(slide.samples.front().t, 0.5);  // f_c/s
}

TEST(Slide, BackwardsIsTheSameTurnedRound) {
  const Slide forth = slide_of(ExactRamp{}.run(), kStep);
  const Slide back = slide_of(ExactRamp{.rate = -0.1}.run(), kStep);
  EXPECT_EQ(forth.direction, 1);
  EXPECT_EQ(back.direction, -1);
  ASSERT_EQ(forth.samples.size(), back.samples.size());
  for (std::size_t i = 0; i < forth.samples.size(); ++i) {
    EXPECT_DOUBLE_EQ(forth.samples[i].position, back.samples[i].position);
    EXPECT_DOUBLE_EQ(forth.samples[i].force, back.samples[i].force);
  }
}

TEST(Slide, StandingAtTheEndOfTheWorkspaceIsNoPartOfIt) {
  RampRun run = ExactRamp{}.run();
  const Slide before = slide_of(run, kStep);
  const RampSample last = run.samples.back();
  for (int i = 1; i <= 1000; ++i) {
    const double bounce = i < 60 ? 1e-4 * std::min(i, 60 - i) : 0;
    run.samples.push_back({last.t + i * 1e-3, last.position - bounce, last.force + i * 1e-4});
  }
  EXPECT_NEAR(static_cast<double>(slide_of(run, kStep).samples.size()), static_cast<double>(before.samples.size()), 4);
}

TEST(Slide, OneWrongSampleDecidesNothing) {
  RampRun run = ExactRamp{}.run();
  const std::size_t length = slide_of(run, kStep).samples.size();
  run.samples[20].position += 0.01;
  run.samples[1000].position += 1;
  run.samples[1200].position -= 1;
  EXPECT_EQ(slide_of(run, kStep).samples.size(), length);
}

TEST(Slide, SaysWhatIsWrongWithARun) {
  EXPECT_EQ(error_of({}), "expected a run of 50 samples or more, found 0");
  RampRun run = ExactRamp{}.run();
  run.samples[7].t = run.samples[6].t;
  EXPECT_EQ(error_of(run), "sample 7: expected a time later than that of the previous sample, found 0.006 s");
  run = ExactRamp{}.run();
  run.samples[3].force = std::nan("");
  EXPECT_EQ(error_of(run), "sample 3: expected finite numbers");
  run = ExactRamp{}.run();
  run.samples[3].position = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_of(run), "sample 3: expected finite numbers");
  EXPECT_EQ(error_of(ExactRamp{}.run(), -1), "encoder_step = -1: expected a finite number of 0 or more");
}

TEST(Slide, RefusesARunWithoutMotion) {
  RampRun run = ExactRamp{}.run();
  for (RampSample& sample : run.samples) sample.position = 0.1;
  EXPECT_EQ(error_of(run), "expected a handle that moves by more than 50 encoder counts, found 0");
  EXPECT_EQ(error_of(run, 0), "expected a handle that moves by more than 50 encoder counts, found 0");
}

TEST(Slide, RefusesAHandleThatTurnsRound) {
  RampRun run = ExactRamp{}.run();
  for (std::size_t i = 1200; i < 1300; ++i) run.samples[i].position -= 0.02;
  EXPECT_NE(error_of(run).find("only moves forward, found a reversal"), std::string::npos) << error_of(run);
}

TEST(Slide, RefusesMotionAgainstTheForce) {
  RampRun run = ExactRamp{}.run();
  for (RampSample& sample : run.samples) sample.force *= -1;
  EXPECT_EQ(error_of(run), "expected motion in the direction of the force, found motion against it");
}

TEST(Slide, RefusesOneThatIsOverInFewSamples) { EXPECT_NE(error_of(ExactRamp{.rate = 1000}.run()), ""); }

TEST(Ramp, IsTheLineOfTheForce) {
  RampRun run = ExactRamp{.rate = 0.1}.run();
  for (RampSample& sample : run.samples) sample.t += 12.5;
  const Ramp ramp = ramp_of(slide_of(run, kStep));
  EXPECT_NEAR(ramp.rate, 0.1, 1e-9);
  EXPECT_NEAR(ramp.start, 12.5 - 0.5e-3, 1e-9);
}

TEST(Ramp, RefusesAForceThatIsNone) {
  RampRun steps = ExactRamp{}.run();
  for (RampSample& sample : steps.samples) sample.force = std::ceil(sample.force / 0.05) * 0.05;
  EXPECT_THROW(ramp_of(slide_of(steps, kStep)), std::invalid_argument);
  RampRun constant = ExactRamp{}.run();
  for (RampSample& sample : constant.samples) sample.force = 0.1;
  EXPECT_THROW(ramp_of(slide_of(constant, kStep)), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::ramp_run_test
