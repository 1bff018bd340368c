// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/release_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace tendon::injector {
namespace {

TEST(ReleaseError, IsZeroBeforeAnythingWasObserved) {
  const ReleaseError error;
  EXPECT_EQ(error.quantile(0.5), Duration::zero());
  EXPECT_EQ(error.max(), Duration::zero());
}

TEST(ReleaseError, QuantilesAreNeverTooLowAndAtMostOne32ndTooHigh) {
  std::mt19937_64 random(3);
  ReleaseError error;
  std::vector<std::int64_t> sorted;
  for (int i = 0; i < 20'000; ++i) {
    const auto ns = static_cast<std::int64_t>(random() >> (24 + random() % 38));  // 2 ns … 18 minutes, log-uniform
    sorted.push_back(ns);
    error.observe(Duration(ns));
  }
  std::ranges::sort(sorted);
  for (const double q : {0.001, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(q * 20'000) - 1;
    const std::int64_t exact = sorted[rank];
    const std::int64_t got = error.quantile(q).count();
    EXPECT_GE(got, exact) << "q = " << q;
    EXPECT_LE(got, exact + exact / 32) << "q = " << q;
  }
  EXPECT_EQ(error.max().count(), sorted.back());
}

TEST(ReleaseError, TheExtremesOfTheClockDoNotOverflow) {
  ReleaseError error;
  error.observe(Duration::max());
  error.observe(Duration::min());
  EXPECT_EQ(error.max(), Duration::max());
  EXPECT_EQ(error.quantile(1), Duration::max());
  EXPECT_EQ(error.quantile(0), Duration::zero());
}

}  // namespace
}  // namespace tendon::injector
