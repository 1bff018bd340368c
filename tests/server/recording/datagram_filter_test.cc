// SPDX-License-Identifier: Apache-2.0
#include "server/recording/datagram_filter.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>

#include "tests/server/recording/recording_samples.h"

namespace tendon::datagram_filter_test {
namespace {

using testing::ms;
using enum DatagramFilter::Sender;
using Verdict = DatagramFilter::Verdict;

TEST(DatagramFilter, RecordsTheFirstFewStrangersOfEachSecond) {
  DatagramFilter filter({.unauthenticated_per_s = 3});
  for (const int second : {0, 1, 5}) {
    for (int i = 0; i < 1000; ++i) {
      const auto verdict = filter.judge(ms(1000 * second + i), kUnauthenticated, 1200);
      EXPECT_EQ(verdict, i < 3 ? Verdict::kRecord : Verdict::kUnauthenticated) << second << " s, " << i;
    }
  }
}

TEST(DatagramFilter, AFloodOfAClientIsRecordedUpToTheBudgetOfEachSecond) {
  DatagramFilter filter({.bytes_per_s = 10'000});
  for (const int second : {0, 1}) {
    std::array<int, 3> count{};
    for (int i = 0; i < 1000; ++i) {
      ++count[static_cast<std::size_t>(filter.judge(ms(1000 * second + i), kClient, 300))];
    }
    EXPECT_EQ(count[static_cast<std::size_t>(Verdict::kRecord)], 33) << "33 × 300 bytes are 9900";
    EXPECT_EQ(count[static_cast<std::size_t>(Verdict::kOverBudget)], 967);
  }
}

TEST(DatagramFilter, ADatagramLargerThanTheWholeBudgetIsLeftOut) {
  DatagramFilter filter({.bytes_per_s = 1000});
  EXPECT_EQ(filter.judge(ms(0), kClient, 1001), Verdict::kOverBudget);
  EXPECT_EQ(filter.judge(ms(0), kClient, 1000), Verdict::kRecord);
  EXPECT_EQ(filter.judge(ms(0), kClient, 1), Verdict::kOverBudget);
}

}  // namespace
}  // namespace tendon::datagram_filter_test
