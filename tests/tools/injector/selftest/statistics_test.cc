// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::injector::statistics_test {
namespace {

double unit_uniform(double x) { return std::clamp(x, 0.0, 1.0); }

std::vector<double> uniform_samples(std::size_t n, std::uint64_t seed) {
  Dice dice(seed);
  std::vector<double> samples(n);
  for (auto& sample : samples) sample = dice.uniform();
  std::ranges::sort(samples);
  return samples;
}

TEST(Statistics, KolmogorovDistanceIsTheWidestGapAboveOrBelow) {
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.5}, unit_uniform), 0.5);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.25, 0.75}, unit_uniform), 0.25);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.1, 0.2, 0.3}, unit_uniform), 0.7);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.7, 0.8, 0.9}, unit_uniform), 0.7);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.5, 0.5, 0.5, 0.5}, unit_uniform), 0.5);
  EXPECT_EQ(kolmogorov_distance({}, unit_uniform), 0);
}

TEST(Statistics, KolmogorovDistanceTakesALawWithSteps) {
  const auto coin = [](double x) { return x < 0 ? 0.0 : x < 1 ? 0.5 : 1.0; };
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.0, 1.0}, coin), 0);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.0, 0.0, 0.0, 1.0}, coin), 0.25);
  EXPECT_DOUBLE_EQ(kolmogorov_distance(std::vector{0.5, 0.5}, coin), 0.5);
}

// Press et al. and the tables: at a significance of 5 % the asymptotic constant is 1.358.
TEST(Statistics, KolmogorovBoundIsTheAsymptoticOne) {
  EXPECT_NEAR(kolmogorov_bound(1, 0.05), 1.358, 5e-4);
  EXPECT_NEAR(kolmogorov_bound(1e6, 0.05), 0.001358, 5e-7);
}

TEST(Statistics, UniformSamplesBreakTheKolmogorovBoundAsOftenAsItSays) {
  int broken = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    broken += kolmogorov_distance(uniform_samples(200, seed), unit_uniform) > kolmogorov_bound(200, 0.1) ? 1 : 0;
  }
  EXPECT_GT(broken, 60);
  EXPECT_LE(broken, 130);
}

TEST(Statistics, AShiftOfOnePercentIsSeenInAHundredThousandSamples) {
  const auto shifted = [](double x) { return unit_uniform(x - 0.01); };
  EXPECT_GT(kolmogorov_distance(uniform_samples(100'000, 1), shifted), kolmogorov_bound(1e5, 1e-6));
}

TEST(Statistics, CorrelatedSamplesCountForFewer) {
  EXPECT_DOUBLE_EQ(independent_samples(1000, 0), 1000);
  // Σ (2/π) asin ρᵏ → ln 2 / −ln ρ for ρ → 1: the integral of asin(u)/u from 0 to 1 is (π/2) ln 2.
  EXPECT_NEAR(independent_samples(100'000'000, 0.9999) / 1e8 * 2 * std::log(2.0) * 1e4, 1, 0.01);
}

// The correction is approximate for dependent samples; this test measures its error.
TEST(Statistics, CorrelatedGaussiansKeepTheBoundOfFewerIndependentSamples) {
  for (const double rho : {0.5, 0.9}) {
    int broken = 0;
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
      Dice dice(seed);
      std::vector<double> samples(1000);
      double z = normal_quantile(dice.uniform());
      for (auto& sample : samples) {
        sample = normal_cdf(z);
        z = rho * z + std::sqrt(1 - rho * rho) * normal_quantile(dice.uniform());
      }
      std::ranges::sort(samples);
      const double bound = kolmogorov_bound(independent_samples(samples.size(), rho), 0.1);
      broken += kolmogorov_distance(samples, unit_uniform) > bound ? 1 : 0;
    }
    EXPECT_LE(broken, 45) << "of 300 at a significance of 10 %, rho " << rho;
    EXPECT_GE(broken, 6) << "of 300 at a significance of 10 %, rho " << rho;
  }
}

TEST(Statistics, ChiSquareIsPearsonsSum) {
  const std::vector<std::uint64_t> counts = {44, 56};
  const std::vector<double> fair = {0.5, 0.5};
  const auto result = chi_square(counts, fair);
  EXPECT_DOUBLE_EQ(result.value, 1.44);
  EXPECT_EQ(result.freedom, 1U);
}

TEST(Statistics, ChiSquareMergesCellsThatExpectFewerThanTen) {
  const std::vector<std::uint64_t> counts = {50, 30, 15, 4, 1};
  const std::vector<double> shares = {0.5, 0.3, 0.14, 0.05, 0.01};
  const auto result = chi_square(counts, shares);
  EXPECT_EQ(result.freedom, 2U) << "the last two are counted with the third";
  EXPECT_DOUBLE_EQ(result.value, 0);
  EXPECT_EQ(chi_square(counts, std::vector<double>{1.0}).freedom, 0U);
}

TEST(Statistics, ChiSquareBoundsAreThoseOfTheTables) {
  EXPECT_NEAR(chi_square_bound(1, 0.05), 3.841458820694124, 1e-8);
  EXPECT_NEAR(chi_square_bound(2, 0.05), 5.991464547107979, 1e-8);
  EXPECT_NEAR(chi_square_bound(10, 0.05), 18.307038053275146, 1e-7);
  EXPECT_NEAR(chi_square_bound(100, 0.05), 124.34211340400407, 1e-6);
  EXPECT_NEAR(chi_square_bound(2, 1e-6), -2 * std::log(1e-6), 1e-6);
  EXPECT_NEAR(chi_square_tail(5.991464547107979, 2), 0.05, 1e-14);
  EXPECT_EQ(chi_square_tail(3, 0), 1);
}

// P(1, x) = 1 − e⁻ˣ, P(1/2, x) = erf √x, P(2, x) = 1 − (1 + x) e⁻ˣ.
TEST(Statistics, IncompleteGammaMeetsItsClosedForms) {
  for (const double x : {1e-6, 0.01, 0.3, 0.99, 1.5, 2.0, 3.1, 10.0, 40.0}) {
    EXPECT_NEAR(incomplete_gamma(1, x), -std::expm1(-x), 1e-14) << x;
    EXPECT_NEAR(incomplete_gamma(0.5, x), std::erf(std::sqrt(x)), 1e-13) << x;
    EXPECT_NEAR(incomplete_gamma(2, x), 1 - (1 + x) * std::exp(-x), 1e-13) << x;
  }
  EXPECT_NEAR(incomplete_gamma(16, 16), 0.5332552, 1e-7);  // Abramowitz & Stegun 26.4: Q(χ² = 32 | 32) = 0.46674
  EXPECT_EQ(incomplete_gamma(3, 0), 0);
  EXPECT_EQ(incomplete_gamma(3, -1), 0);
}

TEST(Statistics, NormalQuantileUndoesTheNormalLaw) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-13);
  EXPECT_NEAR(normal_quantile(1e-9), -5.997807015007687, 1e-12);
  EXPECT_EQ(normal_quantile(0.5), 0);
  EXPECT_EQ(normal_quantile(0), -std::numeric_limits<double>::infinity());
  for (double x = -7; x <= 4; x += 0.125) EXPECT_NEAR(normal_quantile(normal_cdf(x)), x, 1e-11) << x;
}

TEST(Statistics, AnAlternationCorrelatesByMinusOneAndAConstantByNothing) {
  std::vector<double> alternating(1000);
  for (std::size_t i = 0; i < alternating.size(); ++i) alternating[i] = i % 2 == 0 ? 3 : 5;
  EXPECT_NEAR(autocorrelation(alternating, 1), -0.999, 1e-12);
  EXPECT_NEAR(autocorrelation(alternating, 2), 0.998, 1e-12);
  EXPECT_EQ(autocorrelation(std::vector<double>(10, 4.0), 1), 0);
  EXPECT_EQ(autocorrelation(std::vector<double>{1.0}, 1), 0);
}

TEST(Statistics, RunLengthsLeaveOutRunsThatMayHaveBeenLonger) {
  const std::vector<bool> events = {true, false, true, true, false, false, true, false, true, true, false, true};
  EXPECT_EQ(run_lengths(events), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(run_lengths(events, 2), (std::vector<std::uint64_t>{1}));
  EXPECT_TRUE(run_lengths(std::vector<bool>(5, true)).empty());
}

}  // namespace
}  // namespace tendon::injector::statistics_test
