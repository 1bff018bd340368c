// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/loss_chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "tests/support/dice.h"
#include "tests/tools/injector/selftest/statistics.h"

namespace tendon::injector::loss_chain_test {
namespace {

std::vector<bool> played(const LossChain& chain, std::size_t n, std::uint64_t seed) {
  Dice dice(seed);
  std::size_t state = 0;
  std::vector<bool> lost(n);
  for (std::size_t i = 0; i < n; ++i) {
    lost[i] = dice.chance(chain.loss[state]);
    double u = dice.uniform();
    std::size_t next = 0;
    while (next + 1 < chain.loss.size() && u >= chain.step[state][next]) u -= chain.step[state][next++];
    state = next;
  }
  return lost;
}

TEST(LossChain, GilbertsRateAndMeanBurstAreThoseOfTheManual) {
  const auto chain = LossChain::gilbert(0.01, 0.25, 1, 0);
  EXPECT_NEAR(chain.rate(), 0.01 / 0.26, 1e-15);
  const auto bursts = chain.bursts(400);
  double mean = 0;
  for (std::size_t k = 0; k < bursts.size(); ++k) mean += static_cast<double>(k + 1) * bursts[k];
  EXPECT_NEAR(mean, 4, 1e-12);
  // Geometric: P(L = k) = r (1 − r)^(k−1).
  EXPECT_NEAR(bursts[0], 0.25, 1e-15);
  EXPECT_NEAR(bursts[2], 0.25 * 0.75 * 0.75, 1e-15);
}

TEST(LossChain, BurstsComeAtTheRateAndOfTheLengthAskedFor) {
  const auto chain = LossChain::burst(0.02, 5);
  EXPECT_NEAR(chain.rate(), 0.02, 1e-15);
  EXPECT_NEAR(chain.bursts(50)[0], 0.2, 1e-15);
}

TEST(LossChain, ElliottsRateIsTheMixtureOfItsStates) {
  const double p = 0.02;
  const double r = 0.3;
  EXPECT_NEAR(LossChain::gilbert(p, r, 0.8, 0.01).rate(), (p * 0.8 + r * 0.01) / (p + r), 1e-15);
}

// The stationary distribution in closed form: D = p23 p31 + p13 p23 + p13 p32 + p14 p23 p31.
TEST(LossChain, FourStatesShareTheTimeAsTheClosedFormSays) {
  const double p13 = 0.01, p31 = 0.3, p32 = 0.2, p23 = 0.4, p14 = 0.005;
  const auto shares = LossChain::four_state(p13, p31, p32, p23, p14).shares();
  const double d = p23 * p31 + p13 * p23 + p13 * p32 + p14 * p23 * p31;
  EXPECT_NEAR(shares[0], p23 * p31 / d, 1e-15);
  EXPECT_NEAR(shares[1], p13 * p32 / d, 1e-15);
  EXPECT_NEAR(shares[2], p13 * p23 / d, 1e-15);
  EXPECT_NEAR(shares[3], p14 * p23 * p31 / d, 1e-15);
}

// Two states: P(stay in 0) = π₀ + π₁ exp(−(a + b) t) for rates a out of 0 and b out of 1.
TEST(LossChain, TwoRegimesLookedAtNowAndThenMeetTheirClosedForm) {
  const auto chain = LossChain::regimes({50, 20}, 3, {0, 1});
  EXPECT_NEAR(chain.step[0][0], 5.0 / 7 + 2.0 / 7 * std::exp(-3 * (1.0 / 50 + 1.0 / 20)), 1e-12);
  EXPECT_NEAR(chain.rate(), 2.0 / 7, 1e-12);
}

TEST(LossChain, RegimesShareTheTimeByTheirDwellTimes) {
  const auto shares = LossChain::regimes({50, 20, 5}, 1, {0, 0, 0}).shares();
  EXPECT_NEAR(shares[0], 50.0 / 75, 1e-12);
  EXPECT_NEAR(shares[1], 20.0 / 75, 1e-12);
  EXPECT_NEAR(shares[2], 5.0 / 75, 1e-12);
}

TEST(LossChain, IndependentLossesHaveTheVarianceOfIndependentLosses) {
  EXPECT_NEAR(LossChain::bernoulli(0.03).variance_factor(), 1, 1e-12);
  // Gilbert: the indicator is the state, a two-state chain with eigenvalue λ = 1 − p − r: (1 + λ) / (1 − λ).
  EXPECT_NEAR(LossChain::gilbert(0.01, 0.25, 1, 0).variance_factor(), 1.74 / 0.26, 1e-9);
}

TEST(LossChain, BurstsOfOneKindAreIndependentAndOfTwoAreNot) {
  EXPECT_EQ(LossChain::bernoulli(0.1).bursts_to_forget(), 1U);
  EXPECT_EQ(LossChain::burst(0.1, 3).bursts_to_forget(), 1U);
  EXPECT_GT(LossChain::four_state(0.01, 0.1, 0.3, 0.4, 0.02).bursts_to_forget(), 3U);
  EXPECT_LT(LossChain::four_state(0.01, 0.1, 0.3, 0.4, 0.02).bursts_to_forget(), 100U);
}

TEST(LossChain, DiceAgreeWithTheClosedForms) {
  const LossChain chains[] = {LossChain::bernoulli(0.1), LossChain::burst(0.05, 4),
                              LossChain::gilbert(0.05, 0.3, 0.7, 0.02),
                              LossChain::four_state(0.01, 0.1, 0.3, 0.4, 0.02)};
  for (const auto& chain : chains) {
    constexpr std::size_t kCount = 400'000;
    const auto lost = played(chain, kCount, 3);
    const double p = chain.rate();
    const auto counted = static_cast<double>(std::accumulate(lost.begin(), lost.end(), 0));
    EXPECT_NEAR(counted, kCount * p, 4 * std::sqrt(kCount * p * (1 - p) * chain.variance_factor())) << p;
    const auto fit = chi_square(run_lengths(lost, chain.bursts_to_forget()), chain.bursts(200));
    EXPECT_GT(fit.freedom, 0U) << p;
    EXPECT_LT(fit.value, chi_square_bound(fit.freedom, 1e-3)) << p;
  }
}

TEST(LossChain, AnotherMeanBurstIsSeen) {
  const auto lost = played(LossChain::burst(0.05, 4), 400'000, 3);
  const auto fit = chi_square(run_lengths(lost), LossChain::burst(0.05, 4.5).bursts(200));
  EXPECT_GT(fit.value, chi_square_bound(fit.freedom, 1e-6));
}

}  // namespace
}  // namespace tendon::injector::loss_chain_test
