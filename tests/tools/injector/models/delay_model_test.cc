// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/delay_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/tools/injector/models/draws.h"

namespace tendon::injector::delay_model_test {
namespace {

using namespace std::chrono_literals;

QuantileTable table_of(const std::string& delay) { return delay_table(parse_profile("delay=" + delay).delay); }

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

struct Law {
  std::string delay;
  std::function<double(double)> cdf;  ///< of the delay in ms
};

/// The laws in closed form, with libm.
std::vector<Law> laws() {
  const double sigma = std::sqrt(std::log(1 + 0.25 * 0.25));  // of lognormal(20, 5)
  const double mu = std::log(20.0) - sigma * sigma / 2;
  return {
      {"uniform(15ms,25ms)", [](double x) { return std::clamp((x - 15) / 10, 0.0, 1.0); }},
      {"normal(40ms,4ms)", [](double x) { return normal_cdf((x - 40) / 4); }},
      {"exponential(5ms,8ms)", [](double x) { return x < 5 ? 0 : 1 - std::exp(-(x - 5) / 3); }},
      {"lognormal(20ms,5ms)", [=](double x) { return normal_cdf((std::log(x) - mu) / sigma); }},
      {"pareto(2ms,2.5)", [](double x) { return x < 2 ? 0 : 1 - std::pow(2 / x, 2.5); }},
      {"gamma(20ms,10ms)", [](double x) { return 1 - std::exp(-x / 5) * (1 + x / 5 * (1 + x / 10 * (1 + x / 15))); }},
      {"mixture(2ms,3:10ms,1:0.1ms)",
       [](double x) { return x < 2 ? 0 : 1 - 0.75 * std::exp(-(x - 2) / 10) - 0.25 * std::exp(-(x - 2) / 0.1); }},
      {"gamma(2ms,2.828427ms)", [](double x) { return std::erf(std::sqrt(std::max(x, 0.0) / 4)); }},  // shape ½
  };
}

TEST(DelayTable, OfEachLawInvertsItsClosedForm) {
  for (const Law& law : laws()) {
    const QuantileTable table = table_of(law.delay);
    for (double p = 0.5; p > 1e-9; p *= 0.77) {
      for (const double share : {p, 1 - p}) {
        const double x = static_cast<double>(table(static_cast<std::uint64_t>(share * 0x1p64))) * 1e-6;
        const double near = 2e-6;  // ms; table values are integer nanoseconds
        const double allowed = 1e-3 * std::min(p, 1 - p) + 1e-12;
        EXPECT_LE(law.cdf(x - near), share + allowed) << law.delay << " " << p;
        EXPECT_GE(law.cdf(x + near), share - allowed) << law.delay << " " << p;
      }
    }
  }
}

TEST(DelayTable, UniformReachesBothEndsInclusive) {
  const QuantileTable table = table_of("uniform(0.000004ms,0.000006ms)");
  EXPECT_EQ(table(0), 4);
  EXPECT_EQ(table(std::uint64_t{1} << 63), 5);
  EXPECT_EQ(table(~std::uint64_t{0}), 6);
}

TEST(DelayTable, DelaysBelowZeroAreZeroAndNoneIsAboveTheLongest) {
  EXPECT_EQ(table_of("normal(1ms,4ms)")(0), 0);
  EXPECT_EQ(table_of("pareto(1s,0.1)")(~std::uint64_t{0}), kMaxDelay.count());
}

// The cache key includes the kind of the distribution and the order of its parameters.
TEST(DelayTable, IsTheSameWhenAskedForAgainAndAnothersForOtherNumbers) {
  std::set<std::uint64_t> different;
  const auto ask_for_all = [&] {
    for (const char* kind : {"normal", "exponential", "lognormal", "gamma"}) {
      for (const char* numbers : {"(20ms,30ms)", "(20ms,40ms)", "(10ms,30ms)"}) {
        different.insert(table_of(kind + std::string(numbers)).hash());
      }
    }
    different.insert(table_of("pareto(20ms,2.5)").hash());
    different.insert(table_of("pareto(20ms,2.6)").hash());
  };
  ask_for_all();
  EXPECT_EQ(different.size(), 14U);
  for (int i = 1; i <= 300; ++i) table_of("exponential(1ms," + std::to_string(1 + i) + "ms)");  // more than are kept
  ask_for_all();
  EXPECT_EQ(different.size(), 14U);
}

TEST(DelayTable, AHistogramNeverGivesWhatLiesInAnEmptyBin) {
  const QuantileTable table = table_of("histogram(1ms:0,2ms:1,3ms:0,4ms:1,5ms:0)");
  const Draws draws(1, 0, Direction::kUp);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    const Duration d(table(draws(Purpose::kDelay, i)));
    EXPECT_TRUE((d >= 2ms && d < 3ms) || (d >= 4ms && d < 5ms)) << d.count();
  }
  EXPECT_EQ(Duration(table(0)), 2ms);
  EXPECT_EQ(Duration(table((std::uint64_t{1} << 63) - 1)), 3ms - 1ns);
  EXPECT_EQ(Duration(table(std::uint64_t{1} << 63)), 4ms);
  EXPECT_EQ(Duration(table(~std::uint64_t{0})), 5ms - 1ns);
}

TEST(DelayTable, TheLastBinIsAsWideAsTheOneBeforeItAndASingleOneIsConstant) {
  EXPECT_EQ(Duration(table_of("histogram(1ms:0,3ms:1)")(~std::uint64_t{0})), 5ms - 1ns);
  EXPECT_EQ(Duration(table_of("histogram(2ms:8)")(~std::uint64_t{0})), 2ms);
}

TEST(DelayTable, SamplesGiveTheseValuesAndNoOthersInTheirShares) {
  const QuantileTable table = table_of("samples(1ms:1,2ms:3,9ms:0,20ms:4)");
  std::vector<int> seen(21);
  for (std::uint64_t i = 0; i < 800; ++i)
    ++seen[static_cast<std::size_t>(table(i * (~std::uint64_t{0} / 800)) / 1'000'000)];
  EXPECT_NEAR(seen[1], 100, 1);
  EXPECT_NEAR(seen[2], 300, 1);
  EXPECT_NEAR(seen[20], 400, 1);
  EXPECT_EQ(seen[1] + seen[2] + seen[20], 800);
}

TEST(Copula, OneTimeHasOneDeviateAndLongAfterNothingIsLeft) {
  Copula copula(0, 20ms);
  const std::uint64_t first = copula.next(123, LocalTime(1s));
  EXPECT_EQ(copula.next(~std::uint64_t{0} / 3, LocalTime(1s)), first);
  Copula fresh(0, 20ms);
  const std::uint64_t draw = 0x8123456789abcdef;
  EXPECT_EQ(copula.next(draw, LocalTime(3600s)), fresh.next(draw, LocalTime(3600s)));
}

TEST(Copula, WithoutCorrelationIsTrivial) {
  EXPECT_TRUE(Copula(0, {}).trivial());
  EXPECT_FALSE(Copula(0.5, {}).trivial());
  EXPECT_FALSE(Copula(0, 1us).trivial());
}

}  // namespace
}  // namespace tendon::injector::delay_model_test
