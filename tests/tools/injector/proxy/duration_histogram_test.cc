// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/duration_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace tendon::injector::duration_histogram_test {
namespace {

TEST(DurationHistogram, IsZeroBeforeAnythingWasObserved) {
  const DurationHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), Duration::zero());
  EXPECT_EQ(histogram.max(), Duration::zero());
}

TEST(DurationHistogram, QuantilesAreNeverTooLowAndAtMostOne32ndTooHigh) {
  std::mt19937_64 random(3);
  DurationHistogram histogram;
  std::vector<std::int64_t> sorted;
  for (int i = 0; i < 20'000; ++i) {
    const auto ns = static_cast<std::int64_t>(random() >> (24 + random() % 38));  // 2 ns … 18 minutes, log-uniform
    sorted.push_back(ns);
    histogram.observe(Duration(ns));
  }
  std::ranges::sort(sorted);
  for (const double q : {0.001, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(q * 20'000) - 1;
    const std::int64_t exact = sorted[rank];
    const std::int64_t got = histogram.quantile(q).count();
    EXPECT_GE(got, exact) << "q = " << q;
    EXPECT_LE(got, exact + exact / 32) << "q = " << q;
  }
  EXPECT_EQ(histogram.max().count(), sorted.back());
}

TEST(DurationHistogram, TheExtremesOfTheClockDoNotOverflow) {
  DurationHistogram histogram;
  histogram.observe(Duration::max());
  histogram.observe(Duration::min());
  EXPECT_EQ(histogram.max(), Duration::max());
  EXPECT_EQ(histogram.quantile(1), Duration::max());
  EXPECT_EQ(histogram.quantile(0), Duration::zero());
}

TEST(DurationHistogram, SinceAnEarlierCopyIsWhatCameAfterIt) {
  using namespace std::chrono_literals;
  DurationHistogram all;
  all.observe(5ms);
  all.observe(1us);
  const DurationHistogram earlier = all;
  EXPECT_EQ(all.since(earlier).count(), 0U);
  EXPECT_EQ(all.since(earlier).max(), Duration::zero());
  all.observe(40ns);
  all.observe(60ns);
  const DurationHistogram later = all.since(earlier);
  EXPECT_EQ(later.count(), 2U);
  EXPECT_EQ(later.quantile(0.5), 40ns);
  EXPECT_EQ(later.max(), 60ns);
}

}  // namespace
}  // namespace tendon::injector::duration_histogram_test
