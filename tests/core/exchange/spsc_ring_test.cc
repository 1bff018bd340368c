// SPDX-License-Identifier: Apache-2.0
#include "core/exchange/spsc_ring.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <thread>

namespace tendon::spsc_ring_test {
namespace {

TEST(SpscRing, GivesBackEverythingInOrder) {
  SpscRing<int> ring(4);
  EXPECT_EQ(ring.front(), nullptr);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.try_push(i));
    for (int i = 0; i < 4; ++i) {
      ASSERT_NE(ring.front(), nullptr);
      EXPECT_EQ(*ring.front(), i);
      ring.pop();
    }
    EXPECT_EQ(ring.front(), nullptr);
  }
}

TEST(SpscRing, SaysSoWhenItIsFullAndKeepsWhatItHas) {
  SpscRing<int> ring(2);
  EXPECT_TRUE(ring.try_push(1));
  EXPECT_TRUE(ring.try_push(2));
  EXPECT_FALSE(ring.try_push(3));
  EXPECT_EQ(*ring.front(), 1);
}

TEST(SpscRing, AValueWrittenInPlaceIsNotThereBeforeItIsPushed) {
  SpscRing<int> ring(2);
  *ring.back() = 1;
  EXPECT_EQ(ring.front(), nullptr);
  ring.push();
  ASSERT_NE(ring.front(), nullptr);
  EXPECT_EQ(*ring.front(), 1);
  EXPECT_TRUE(ring.try_push(2));
  EXPECT_EQ(ring.back(), nullptr);
}

TEST(SpscRing, RefusesACapacityThatIsNoPowerOfTwo) {
  EXPECT_THROW(SpscRing<int>(0), std::invalid_argument);
  EXPECT_THROW(SpscRing<int>(3), std::invalid_argument);
}

TEST(SpscRing, BetweenThreadsNothingIsLostTornOrReordered) {
  struct Pair {
    std::uint64_t a, b;
  };
  constexpr std::uint64_t kLast = 200000;
  SpscRing<Pair> ring(64);
  std::jthread writer([&ring] {
    for (std::uint64_t i = 1; i <= kLast;) {
      if (ring.try_push({i, ~i})) ++i;
    }
  });
  for (std::uint64_t expected = 1; expected <= kLast;) {
    const Pair* pair = ring.front();
    if (pair == nullptr) continue;
    ASSERT_EQ(pair->a, expected);
    ASSERT_EQ(pair->b, ~expected);
    ring.pop();
    ++expected;
  }
}

}  // namespace
}  // namespace tendon::spsc_ring_test
