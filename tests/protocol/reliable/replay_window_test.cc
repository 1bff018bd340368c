// SPDX-License-Identifier: Apache-2.0
#include "protocol/reliable/replay_window.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace tendon::replay_window_test {
namespace {

TEST(ReplayWindow, TellsThe32NumbersBeforeOne) {
  ReplayWindow window;
  for (const std::uint64_t n : {10U, 67U, 97U, 98U, 100U}) window.insert(n);
  EXPECT_EQ(window.mask_before(100), (1U << 1U) | (1U << 2U));  // 98 and 97; 67 is out of range
  EXPECT_EQ(window.mask_before(99), 1U | (1U << 1U) | (1U << 31U));
  window.insert(128);
  EXPECT_EQ(window.mask_before(128), 1U << 27U | 1U << 29U | 1U << 30U);  // across a word boundary
}

TEST(ReplayWindow, SurvivesTheLargestNumber) {
  ReplayWindow window;
  window.insert(3);
  window.insert(~std::uint64_t{0});
  EXPECT_TRUE(window.contains(~std::uint64_t{0}));
  EXPECT_TRUE(window.contains(3));
  EXPECT_FALSE(window.contains(~std::uint64_t{0} - 1));
}

RC_GTEST_PROP(ReplayWindow, DecidesAsASetWithAHorizonDoes, ()) {
  ReplayWindow window;
  std::set<std::uint64_t> model;
  std::uint64_t highest = *rc::gen::inRange<std::uint64_t>(0, 10'000);
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-2200, 200));
  for (const int step : steps) {
    const std::uint64_t number = step < 0 && highest < 2200 ? 0 : highest + static_cast<std::uint64_t>(step);
    const bool too_old = !model.empty() && number + ReplayWindow::kRemembered <= *model.rbegin();
    RC_ASSERT(window.contains(number) == (too_old || model.count(number) == 1));
    if (window.contains(number)) continue;
    window.insert(number);
    model.insert(number);
    highest = *model.rbegin();
    RC_ASSERT(window.missing() == highest + 1 - model.size());
    const std::uint64_t behind = *rc::gen::element<std::uint64_t>(0, 1, 40, 1940, 1960, 1983, 1984, 5000);
    for (const std::uint64_t told : {highest, highest - std::min(behind, highest)}) {
      for (std::uint64_t i = 0; i < 32; ++i) {
        const bool known = i < told && highest - (told - 1 - i) < ReplayWindow::kRemembered;
        RC_ASSERT((window.mask_before(told) >> i & 1U) == (known ? model.count(told - 1 - i) : 0));
      }
    }
  }
}

}  // namespace
}  // namespace tendon::replay_window_test
