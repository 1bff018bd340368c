// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/bottleneck.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace tendon::injector::bottleneck_test {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);

Bottleneck of(const std::string& line) { return parse_profile(line).bottleneck; }

TEST(Bottleneck, ADatagramTakesItsBitsOverTheRateAndThoseBehindItWait) {
  BottleneckQueue queue(of("rate=1Mbit/s overhead=28"), kStart);
  EXPECT_EQ(queue.pass(kStart, 97), kStart + 1ms);  // 125 bytes
  EXPECT_EQ(queue.pass(kStart, 97), kStart + 2ms);
  EXPECT_EQ(queue.pass(kStart + 1500us, 97), kStart + 3ms);
  EXPECT_EQ(queue.pass(kStart + 10ms, 97), kStart + 11ms);
}

TEST(Bottleneck, ABusyLinkKeepsItsRateInFractionsOfNanoseconds) {
  BottleneckQueue queue(of("rate=7Mbit/s queue=1000000packets overhead=0"), kStart);
  std::optional<LocalTime> last;
  for (int i = 0; i < 70'000; ++i) last = queue.pass(kStart, 100);
  EXPECT_EQ(last, kStart + 8s);  // 56 Mbit
}

TEST(Bottleneck, DropsWhatFindsNoRoomAndTheOneBeingSentStillTakesRoom) {
  BottleneckQueue packets(of("rate=1Mbit/s queue=2packets overhead=0"), kStart);
  EXPECT_TRUE(packets.pass(kStart, 125));
  EXPECT_TRUE(packets.pass(kStart, 125));
  EXPECT_FALSE(packets.pass(kStart, 125));
  EXPECT_FALSE(packets.pass(kStart + 1ms - 1ns, 125));
  EXPECT_EQ(packets.pass(kStart + 1ms, 125), kStart + 3ms);
  BottleneckQueue bytes(of("rate=1Mbit/s queue=300B overhead=0"), kStart);
  EXPECT_TRUE(bytes.pass(kStart, 200));
  EXPECT_FALSE(bytes.pass(kStart, 101));
  EXPECT_TRUE(bytes.pass(kStart, 100));
}

TEST(Bottleneck, AFullQueueHoldsBackNoLongerThanItsBytesTake) {
  BottleneckQueue queue(of("rate=1Mbit/s queue=12500B overhead=0"), kStart);
  Duration longest{};
  int dropped = 0;
  for (int i = 0; i < 10'000; ++i) {
    const LocalTime now = kStart + i * 500us;  // twice what the link can send
    const auto passed = queue.pass(now, 125);
    if (passed) longest = std::max(longest, *passed - now);
    dropped += passed ? 0 : 1;
  }
  EXPECT_LE(longest, 100ms);
  EXPECT_GT(longest, 98ms);
  EXPECT_NEAR(dropped, 5000, 101);
}

TEST(Bottleneck, FifoHoldsForAClockThatGoesBack) {
  BottleneckQueue queue(of("rate=1Mbit/s overhead=0"), kStart);
  EXPECT_EQ(queue.pass(kStart + 5ms, 125), kStart + 6ms);
  EXPECT_EQ(queue.pass(kStart, 125), kStart + 7ms);
}

/// A direct model of mm-link: each opportunity sends up to 1500 waiting bytes. Returns the time of each last byte.
std::vector<LocalTime> mm_link(const std::vector<std::uint32_t>& opportunities,
                               const std::vector<std::pair<LocalTime, std::uint64_t>>& datagrams) {
  std::vector<LocalTime> left;
  std::size_t head = 0;
  std::uint64_t rest = datagrams.empty() ? 0 : datagrams[0].second;
  for (std::uint64_t cycle = 0; head < datagrams.size(); ++cycle) {
    for (const std::uint32_t ms : opportunities) {
      const LocalTime now = kStart + std::chrono::milliseconds(cycle * opportunities.back() + ms);
      std::uint64_t room = 1500;
      while (head < datagrams.size() && datagrams[head].first <= now && room > 0) {
        const std::uint64_t bytes = std::min(room, rest);
        room -= bytes;
        rest -= bytes;
        if (rest > 0) break;
        left.push_back(now);
        if (++head < datagrams.size()) rest = datagrams[head].second;
      }
    }
  }
  return left;
}

RC_GTEST_PROP(Bottleneck, OpportunitiesAreUsedAsMahimahiUsesThem, ()) {
  Bottleneck bottleneck;
  std::uint32_t ms = *rc::gen::inRange<std::uint32_t>(0, 3);
  for (int n = *rc::gen::inRange(1, 8); n > 0; --n) {
    bottleneck.opportunities_ms.push_back(ms);
    ms += *rc::gen::inRange<std::uint32_t>(0, 6);
  }
  bottleneck.opportunities_ms.push_back(ms + 1);
  std::vector<std::pair<LocalTime, std::uint64_t>> datagrams;
  LocalTime at = kStart;
  for (int n = *rc::gen::inRange(0, 60); n > 0; --n) {
    at += *rc::gen::element<Duration>(0ms, 1ms, 300us, 1ns, 17ms, 1ms - 1ns);
    datagrams.emplace_back(at, *rc::gen::inRange<std::uint64_t>(28, 4000));
  }
  const std::vector<LocalTime> expected = mm_link(bottleneck.opportunities_ms, datagrams);
  BottleneckQueue queue(bottleneck, kStart);
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    RC_ASSERT(queue.pass(datagrams[i].first, static_cast<std::uint32_t>(datagrams[i].second - 28)) == expected[i]);
  }
}

TEST(Bottleneck, WhatIsInTheQueueIsAheadOfWhatComesAfterAChange) {
  BottleneckQueue slow(of("rate=1Mbit/s overhead=0"), kStart);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(slow.pass(kStart, 125));
  BottleneckQueue fast(of("rate=10Mbit/s overhead=0 queue=10packets"), kStart + 1ms);
  fast.continue_from(std::move(slow));
  EXPECT_EQ(fast.pass(kStart + 1ms, 125), kStart + 10ms + 100us);
  EXPECT_FALSE(fast.pass(kStart + 1ms, 125));
}

}  // namespace
}  // namespace tendon::injector::bottleneck_test
