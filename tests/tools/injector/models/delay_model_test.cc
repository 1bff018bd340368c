// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/delay_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
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

/// The closed form of each law, by libm.
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
      {"gamma(2ms,2.828427ms)", [](double x) { return std::erf(std::sqrt(std::max(x, 0.0) / 4)); }},  // shape ½
  };
}

TEST(DelayTable, OfEachLawInvertsItsClosedForm) {
  for (const Law& law : laws()) {
    const QuantileTable table = table_of(law.delay);
    for (double p = 0.5; p > 1e-9; p *= 0.77) {
      for (const double share : {p, 1 - p}) {
        const double x = static_cast<double>(table(static_cast<std::uint64_t>(share * 0x1p64))) * 1e-6;
        const double near = 2e-6;  // ms: tables are in whole nanoseconds
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

// A table is kept and found again by its numbers: those of another kind, or in another order, are another's.
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

/// The Kolmogorov-Smirnov distance of delays (in ns) from a cdf (of ms).
double distance(std::vector<std::int64_t> delays, const std::function<double(double)>& cdf) {
  std::ranges::sort(delays);
  const auto n = static_cast<double>(delays.size());
  double worst = 0;
  for (std::size_t i = 0; i < delays.size(); ++i) {
    const double expected = cdf(static_cast<double>(delays[i]) * 1e-6);
    const auto rank = static_cast<double>(i);
    worst = std::max({worst, expected - rank / n, (rank + 1) / n - expected});
  }
  return worst;
}

double correlation(const std::vector<double>& x) {
  double mean = 0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  double square = 0;
  double product = 0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    square += (x[i] - mean) * (x[i] - mean);
    product += (x[i] - mean) * (x[i - 1] - mean);
  }
  return product / square;
}

/// What netem does instead: a moving average of the uniforms themselves.
class NetemCorrelation {
 public:
  explicit NetemCorrelation(double rho) : rho_(rho) {}
  double next(double u) { return last_ = (1 - rho_) * u + rho_ * last_; }

 private:
  double rho_;
  double last_ = 0.5;
};

TEST(Copula, TheDistributionOfDelaysIsExactWhateverTheCorrelation) {
  const QuantileTable table = table_of("exponential(5ms,8ms)");
  const auto cdf = [](double x) { return x < 5 ? 0 : 1 - std::exp(-(x - 5) / 3); };
  const Draws draws(3, 0, Direction::kUp);
  constexpr int kDraws = 200'000;
  for (const double rho : {0.1, 0.5, 0.9, 0.99}) {
    Copula copula(rho, {});
    NetemCorrelation netem(rho);
    std::vector<std::int64_t> delays;
    std::vector<std::int64_t> of_netem;
    for (std::uint64_t i = 0; i < kDraws; ++i) {
      const std::uint64_t u = draws(Purpose::kDelay, i);
      delays.push_back(table(copula.next(u, {})));
      of_netem.push_back(
          table(static_cast<std::uint64_t>(netem.next(static_cast<double>(u >> 11) * 0x1p-53) * 0x1p64)));
    }
    // Correlated draws are worth n(1 − ρ)/(1 + ρ) independent ones; 2/√n is exceeded by one seed in 1500.
    const double allowed = 2 / std::sqrt(kDraws * (1 - rho) / (1 + rho));
    EXPECT_LT(distance(delays, cdf), allowed) << rho;
    EXPECT_GT(distance(of_netem, cdf), 0.02) << rho;
  }
}

/// z of a draw, from the copula's own result: Φ⁻¹ by bisection would do; a normal table is that.
std::vector<double> deviates(Copula copula, Duration gap) {
  const QuantileTable normal = table_of("normal(30s,1s)");
  const Draws draws(5, 0, Direction::kUp);
  std::vector<double> z;
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const std::uint64_t u = copula.next(draws(Purpose::kDelay, i), LocalTime(gap * i));
    z.push_back(static_cast<double>(normal(u)) * 1e-9 - 30);
  }
  return z;
}

TEST(Copula, ConsecutiveDeviatesAreCorrelatedAsAskedByPacketAndByTime) {
  // The standard deviation of an estimated correlation is at most √(1 − ρ²)/√n < 0.0023.
  for (const double rho : {0.0, 0.3, 0.9}) EXPECT_NEAR(correlation(deviates(Copula(rho, {}), 1ms)), rho, 0.009) << rho;
  for (const Duration gap : {1ms, 7ms, 40ms}) {
    const double rho = std::exp(-static_cast<double>(gap / 1ms) / 20);
    EXPECT_NEAR(correlation(deviates(Copula(0, 20ms), gap)), rho, 0.009) << gap.count();
  }
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

/// The share of the histogram's weight below x ms, straight within a bin: the CDF as a person would write it down, to
/// check the integer inverse of it.
double cdf(const std::vector<Weighted>& bins, double x) {
  double below = 0;
  double total = 0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const std::size_t edge = std::min(i, bins.size() - 2);
    const double width = seconds(bins[edge + 1].value - bins[edge].value) * 1e3;
    total += bins[i].weight;
    below += bins[i].weight * std::clamp((x - seconds(bins[i].value) * 1e3) / width, 0.0, 1.0);
  }
  return below / total;
}

/// The same, for the sorted values of many draws: as fine as a 64th of a bin.
TEST(DelayTable, DrawsFollowEachMeasured5gHistogram) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  const std::filesystem::path folder = std::filesystem::path(data != nullptr ? data : "") / "d6g-tsn-5g/hist";
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the measured histograms are not checked";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is not there";
  constexpr std::uint64_t kDraws = 1'000'000;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const Delay delay = parse_profile("delay=histogram(" + entry.path().string() + ")").delay;
    const auto& bins = std::get<HistogramDelay>(delay).bins;
    EXPECT_GE(bins.size(), 100U) << entry.path();
    const QuantileTable table = delay_table(delay);
    const Draws draws(1, 0, Direction::kUp);
    // Counted in 64ths of a bin, all of which are equally wide in these files.
    const Duration width = (bins.back().value - bins.front().value) / static_cast<std::int64_t>(bins.size() - 1) / 64;
    std::vector<int> counts((bins.size() + 1) * 64 + 1);
    for (std::uint64_t i = 0; i < kDraws; ++i) {
      const Duration d = Duration(table(draws(Purpose::kDelay, i))) - bins.front().value;
      ASSERT_GE(d, 0ns);
      ++counts.at(static_cast<std::size_t>(d / width));
    }
    double worst = 0;
    double below = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double x = seconds(bins.front().value + width * static_cast<std::int64_t>(i)) * 1e3;
      worst = std::max(worst, std::abs(below / kDraws - cdf(bins, x)));
      below += counts[i];
    }
    // 1.628/√n is exceeded by one right table in a hundred.
    EXPECT_LT(worst, 1.628 / std::sqrt(static_cast<double>(kDraws))) << entry.path();
    RecordProperty(entry.path().stem().string(), std::to_string(worst));
    ++files;
  }
  EXPECT_EQ(files, 6);
}

}  // namespace
}  // namespace tendon::injector::delay_model_test
