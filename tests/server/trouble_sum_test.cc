// SPDX-License-Identifier: Apache-2.0
#include "server/trouble_sum.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <tuple>
#include <vector>

namespace tendon::trouble_sum_test {
namespace {

using std::chrono::seconds;

/// Returns (second, count, per minute) of each message if there are `often` events in each second.
std::vector<std::tuple<int, std::uint64_t, bool>> logged(int for_s, const std::function<std::uint64_t(int)>& often) {
  std::vector<std::tuple<int, std::uint64_t, bool>> all;
  TroubleSum sum;
  for (int s = 0; s < for_s; ++s) {
    if (const auto due = sum.add(LocalTime(seconds(100 + s)), often(s)))
      all.emplace_back(s, due->count, due->of_a_minute);
  }
  return all;
}

TEST(TroubleSum, TellsTheFirstAtOnceAndThenOnceAMinute) {
  EXPECT_EQ(logged(200, [](int) { return 2; }),
            (std::vector<std::tuple<int, std::uint64_t, bool>>{
                {0, 2, false}, {60, 120, true}, {120, 120, true}, {180, 120, true}}));
}

TEST(TroubleSum, SaysNothingWhereNothingHappens) {
  EXPECT_TRUE(logged(200, [](int) { return 0; }).empty());
}

TEST(TroubleSum, LosesNoneAndTellsOneAfterAQuietTimeAtOnce) {
  EXPECT_EQ(logged(200, [](int s) { return s == 0 || s == 10 || s == 150 ? 1 : 0; }),
            (std::vector<std::tuple<int, std::uint64_t, bool>>{{0, 1, false}, {60, 1, true}, {150, 1, false}}));
}

}  // namespace
}  // namespace tendon::trouble_sum_test
