// SPDX-License-Identifier: Apache-2.0
#include "core/exchange/latest.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

namespace tendon::latest_test {
namespace {

TEST(Latest, IsEmptyUntilSomethingIsPutAndAgainOnceTaken) {
  Latest<int> box;
  EXPECT_EQ(box.take(), nullptr);
  box.put(7);
  ASSERT_NE(box.take(), nullptr);
  EXPECT_EQ(box.take(), nullptr);
}

TEST(Latest, ForgetsAllButTheNewest) {
  Latest<int> box;
  for (int i = 0; i < 10; ++i) box.put(i);
  EXPECT_EQ(*box.take(), 9);
}

TEST(Latest, AValueStaysReadableUntilTheNextTake) {
  Latest<int> box;
  box.put(1);
  const int* first = box.take();
  box.put(2);
  box.put(3);
  EXPECT_EQ(*first, 1);
  EXPECT_EQ(*box.take(), 3);
}

TEST(Latest, BetweenThreadsNoValueIsTornAndNoneComesBefore) {
  constexpr std::uint64_t kLast = 200000;
  Latest<std::array<std::uint64_t, 16>> box;
  std::jthread writer([&box] {
    std::array<std::uint64_t, 16> value{};
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      value.fill(i);
      box.put(value);
    }
  });
  std::uint64_t newest = 0;
  while (newest < kLast) {
    const auto* value = box.take();
    if (value == nullptr) continue;
    ASSERT_GT(value->front(), newest);
    newest = value->front();
    for (const std::uint64_t word : *value) ASSERT_EQ(word, newest);
  }
}

}  // namespace
}  // namespace tendon::latest_test
