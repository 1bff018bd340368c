// SPDX-License-Identifier: Apache-2.0
//
// selftest_test.cc checks the rates and bursts of each model.
#include "tests/tools/injector/models/loss_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace tendon::injector::loss_model_test {
namespace {

std::vector<bool> losses(const std::string& loss, std::uint64_t count, std::uint64_t seed = 1) {
  LossModel model(parse_profile("loss=" + loss).loss, Purpose::kLoss, Purpose::kLossState);
  const Draws draws(seed, 0, Direction::kUp);
  std::vector<bool> all;
  for (std::uint64_t i = 0; i < count; ++i) all.push_back(model.lost(draws, i));
  return all;
}

TEST(LossModel, AChainBeginsStationarySoShortRunsLoseAsMuchAsLongOnes) {
  constexpr int kRuns = 20'000;
  int first = 0;
  int third = 0;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    const auto run = losses("gilbert(1%,4%,100%,0%)", 3, seed);
    first += run[0] ? 1 : 0;
    third += run[2] ? 1 : 0;
  }
  EXPECT_NEAR(first, kRuns * 0.2, 4 * std::sqrt(kRuns * 0.2 * 0.8));
  EXPECT_NEAR(third, kRuns * 0.2, 4 * std::sqrt(kRuns * 0.2 * 0.8));
}

TEST(LossModel, APatternRepeatsFromTheFirstDatagram) {
  EXPECT_EQ(losses("pattern(0010)", 8), (std::vector<bool>{false, false, true, false, false, false, true, false}));
}

TEST(LossModel, OneDatagramPassesAfterEachBurstHoweverLong) {
  // The median length is 10 000 datagrams.
  const auto run = losses("bursts(pareto2,100%,100%,1:10000,100:0)", 200'000);
  std::size_t passed = 0;
  for (std::size_t i = 1; i < run.size(); ++i) passed += run[i] ? 0 : 1;
  EXPECT_GT(passed, 4U);
  EXPECT_LT(passed, 200U);
  const auto none = losses("bursts(pareto2,5%,10%,4:0,4:0)", 1000);
  EXPECT_EQ(std::ranges::count(none, true), 0);
}

TEST(LossModel, AnotherModelOfTheSameKindGoesOnFromTheState) {
  const Draws draws(1, 0, Direction::kUp);
  LossModel bad(GilbertLoss{1, 0, 1, 0}, Purpose::kLoss, Purpose::kLossState);
  EXPECT_TRUE(bad.lost(draws, 0));
  LossModel stays(GilbertLoss{0, 1e-9, 1, 0}, Purpose::kLoss, Purpose::kLossState);  // the stationary state is good
  LossModel fresh = stays;
  stays.continue_from(bad);
  EXPECT_TRUE(stays.lost(draws, 1));
  EXPECT_FALSE(fresh.lost(draws, 1));
}

}  // namespace
}  // namespace tendon::injector::loss_model_test
