// SPDX-License-Identifier: Apache-2.0
#include "server/clients/sampled_steps.h"

#include <gtest/gtest.h>

namespace tendon::sampled_steps_test {
namespace {

using std::chrono::milliseconds;

LocalTime at(int ms) { return LocalTime(milliseconds(ms)); }

TEST(SampledSteps, KnowsWhenAStepWasSampledAndWhenItsStateLeft) {
  SampledSteps steps;
  steps.remember();
  steps.observe(7, at(100), at(101));
  const auto found = steps.find(7);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->at, at(100));
  EXPECT_EQ(found->sent, at(101));
  EXPECT_FALSE(steps.find(8)) << "it is still to come";
  EXPECT_FALSE(steps.find(7 + SampledSteps::kRemembered));
  EXPECT_FALSE(steps.find(0)) << "no step has this number";
}

TEST(SampledSteps, FillsStepsThatWereNotSeenEvenly) {
  SampledSteps steps;
  steps.remember();
  steps.observe(10, at(100), at(100));
  steps.observe(14, at(106), at(107));
  const auto between = steps.find(12);
  ASSERT_TRUE(between);
  EXPECT_EQ(between->at, at(103));
  EXPECT_EQ(between->sent, at(107)) << "no state of its own has left";
}

TEST(SampledSteps, ForgetsAStepAfterAsManyAsItRemembers) {
  SampledSteps steps;
  steps.remember();
  for (std::uint64_t tick = 1; tick <= SampledSteps::kRemembered + 1; ++tick) {
    steps.observe(tick, LocalTime(milliseconds(tick)), LocalTime(milliseconds(tick)));
  }
  EXPECT_FALSE(steps.find(1));
  EXPECT_TRUE(steps.find(2));
}

TEST(SampledSteps, FillsNothingAcrossAGapThatItCannotRemember) {
  SampledSteps steps;
  steps.remember();
  steps.observe(1, at(0), at(0));
  steps.observe(1 + SampledSteps::kRemembered, at(5000), at(5000));
  EXPECT_FALSE(steps.find(2));
}

TEST(SampledSteps, NobodyHasSeenAreNotRemembered) {
  SampledSteps steps;
  steps.observe(1, at(1), at(1));
  EXPECT_EQ(steps.newest(), 1U);
  steps.remember();
  EXPECT_FALSE(steps.find(1));
  steps.observe(3, at(3), at(3));
  EXPECT_FALSE(steps.find(2)) << "the step before it is not known";
  EXPECT_TRUE(steps.find(3));
}

TEST(SampledSteps, SentFarTooLateWasSentAtTheLargestDelay) {
  SampledSteps steps;
  steps.remember();
  steps.observe(1, at(0), at(60'000));
  steps.observe(2, at(2), at(1));
  EXPECT_EQ(steps.find(1)->sent, LocalTime(Duration(std::uint32_t(-1))));
  EXPECT_EQ(steps.find(2)->sent, at(2));
}

}  // namespace
}  // namespace tendon::sampled_steps_test
