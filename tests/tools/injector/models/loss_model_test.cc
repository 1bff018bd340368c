// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/loss_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace tendon::injector::loss_model_test {
namespace {

constexpr std::uint64_t kMany = 400'000;

std::vector<bool> losses(const std::string& loss, std::uint64_t count = kMany, std::uint64_t seed = 1) {
  LossModel model(parse_profile("loss=" + loss).loss, Purpose::kLoss, Purpose::kLossState);
  const Draws draws(seed, 0, Direction::kUp);
  std::vector<bool> all;
  for (std::uint64_t i = 0; i < count; ++i) all.push_back(model.lost(draws, i));
  return all;
}

struct Seen {
  double share = 0;
  double mean_burst = 0;
};
Seen seen(const std::vector<bool>& all) {
  double lost = 0;
  double bursts = 0;
  bool before = false;
  for (const bool now : all) {
    lost += now ? 1 : 0;
    bursts += now && !before ? 1 : 0;
    before = now;
  }
  return {lost / static_cast<double>(all.size()), bursts > 0 ? lost / bursts : 0};
}

TEST(LossModel, RandomLossIsAsFrequentAsAskedAndItsBurstsAreThoseOfChance) {
  for (const double p : {0.001, 0.02, 0.3, 0.97}) {
    const Seen s = seen(losses(std::to_string(p)));
    const double sigma = std::sqrt(p * (1 - p) / kMany);
    EXPECT_NEAR(s.share, p, 4 * sigma) << p;
    EXPECT_NEAR(s.mean_burst * (1 - p), 1, 4 * std::sqrt(p / (kMany * p * (1 - p)))) << p;
  }
}

/// The loss of a two-state chain varies more than that of chance: variance of the mean times (1 + λ)/(1 − λ), where λ
/// is how much of a state is left one datagram later.
double sigma(double share, double lambda) {
  return std::sqrt(share * (1 - share) / kMany * (1 + lambda) / (1 - lambda));
}

TEST(LossModel, BurstsHaveTheShareAndTheMeanLengthAskedFor) {
  for (const double length : {1.1, 2.0, 4.0, 20.0}) {
    const double p = 0.05;
    const Seen s = seen(losses("burst(5%," + std::to_string(length) + ")"));
    EXPECT_NEAR(s.share, p, 4 * sigma(p, 1 - 1 / length - p / (1 - p) / length)) << length;
    // Lengths are geometric: standard deviation √(1 − 1/L)·L.
    EXPECT_NEAR(s.mean_burst, length, 4 * length * std::sqrt((1 - 1 / length) / (kMany * p / length)) + 1e-9) << length;
  }
}

TEST(LossModel, BurstsOfTheLengthOfChanceAreRandomLoss) {
  const Seen s = seen(losses("burst(20%,1.25)"));
  EXPECT_NEAR(s.share, 0.2, 4 * std::sqrt(0.2 * 0.8 / kMany));
  EXPECT_NEAR(s.mean_burst, 1.25, 0.01);
}

TEST(LossModel, GilbertAndElliottLoseWhatTheirStatesLoseInTheirShares) {
  const double p = 0.01;
  const double r = 0.2;
  const double bad = p / (p + r);
  EXPECT_NEAR(seen(losses("gilbert(1%,20%,80%,0.1%)")).share, bad * 0.8 + (1 - bad) * 0.001, 4 * sigma(bad, 1 - p - r));
  const Seen simple = seen(losses("gilbert(1%,20%,100%,0%)"));
  EXPECT_NEAR(simple.share, bad, 4 * sigma(bad, 1 - p - r));
  EXPECT_NEAR(simple.mean_burst, 1 / r, 4 * 5 * std::sqrt(0.8 / (kMany * bad * r)));
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

TEST(LossModel, TheFourStatesLoseInBurstsAndAloneAsTheirBalanceSays) {
  const double p13 = 0.01;
  const double p31 = 0.2;
  const double p32 = 0.1;
  const double p23 = 0.3;
  const double p14 = 0.005;
  const double d = p23 * p31 + p13 * p23 + p13 * p32 + p14 * p23 * p31;
  const double in_burst = p13 * p23 / d;
  const double alone = p14 * p23 * p31 / d;
  const Seen s = seen(losses("fourstate(1%,20%,10%,30%,0.5%)"));
  EXPECT_NEAR(s.share, in_burst + alone, 0.0025);  // four standard deviations, from 100 seeds
  // A run of losses is left from state 3 with p31 + p32, from state 4 always; it is entered from 1 and from 2.
  const double runs = in_burst * (p31 + p32) + alone;
  EXPECT_NEAR(s.mean_burst, (in_burst + alone) / runs, 0.1);
  // Isolated losses alone: never two in a row.
  const Seen isolated = seen(losses("fourstate(0%,0%,0%,0%,5%)"));
  EXPECT_NEAR(isolated.share, 0.05 / 1.05, 0.002);
  EXPECT_EQ(isolated.mean_burst, 1);
}

TEST(LossModel, APatternRepeatsFromTheFirstDatagram) {
  EXPECT_EQ(losses("pattern(0010)", 8), (std::vector<bool>{false, false, true, false, false, false, true, false}));
}

TEST(LossModel, AnotherModelOfTheSameKindGoesOnFromTheState) {
  const Draws draws(1, 0, Direction::kUp);
  LossModel bad(GilbertLoss{1, 0, 1, 0}, Purpose::kLoss, Purpose::kLossState);
  EXPECT_TRUE(bad.lost(draws, 0));
  LossModel stays(GilbertLoss{0, 1e-9, 1, 0}, Purpose::kLoss, Purpose::kLossState);  // stationary: good
  LossModel fresh = stays;
  stays.continue_from(bad);
  EXPECT_TRUE(stays.lost(draws, 1));
  EXPECT_FALSE(fresh.lost(draws, 1));
}

}  // namespace
}  // namespace tendon::injector::loss_model_test
