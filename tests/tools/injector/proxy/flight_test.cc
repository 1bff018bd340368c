// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/flight.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tendon::injector::flight_test {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);

std::vector<std::byte> bytes(const std::string& text) {
  std::vector<std::byte> result;
  for (const char c : text) result.push_back(static_cast<std::byte>(c));
  return result;
}

Decision passes(Duration after) {
  Decision decision;
  decision.release = kStart + after;
  return decision;
}

/// The departures until `now` as "tag:payload", with ' for a second copy and " for a stale one.
std::vector<std::string> departures(Flight<int>& flight, LocalTime now) {
  std::vector<std::string> result;
  while (const auto departure = flight.next_due(now)) {
    std::string line = std::to_string(departure->tag) + ":";
    for (const std::byte b : departure->datagram) line += static_cast<char>(b);
    if (departure->copy == Copy::kSecond) line += "'";
    if (departure->copy == Copy::kStale) line += "\"";
    result.push_back(line);
  }
  return result;
}

using Lines = std::vector<std::string>;

TEST(Flight, LeavesInOrderOfDueTimeAndThoseDueTogetherInOrderOfLaunch) {
  Flight<int> flight;
  EXPECT_EQ(flight.next_wake(), std::nullopt);
  flight.launch(passes(20ms), bytes("late"), 1);
  flight.launch(passes(10ms), bytes("a"), 2);
  flight.launch(passes(10ms), bytes("b"), 3);
  flight.launch(passes(10ms), bytes("c"), 4);
  EXPECT_EQ(flight.size(), 4U);
  EXPECT_EQ(flight.next_wake(), kStart + 10ms);
  EXPECT_EQ(departures(flight, kStart + 10ms - 1ns), Lines{});
  EXPECT_EQ(departures(flight, kStart + 10ms), (Lines{"2:a", "3:b", "4:c"}));
  EXPECT_EQ(departures(flight, kStart + 1s), Lines{"1:late"});
  EXPECT_EQ(flight.size(), 0U);
}

TEST(Flight, OrderHoldsForRandomDueTimes) {
  std::mt19937_64 random(1);
  Flight<int> flight;
  std::vector<std::pair<LocalTime, int>> expected;
  for (int i = 0; i < 2000; ++i) {
    const Duration due(random() % 500);
    flight.launch(passes(due), bytes(std::to_string(i)), i);
    expected.emplace_back(kStart + due, i);
  }
  std::ranges::stable_sort(expected, {}, &std::pair<LocalTime, int>::first);
  for (const auto& [due, i] : expected) {
    const auto departure = flight.next_due(LocalTime::max());
    ASSERT_TRUE(departure);
    ASSERT_EQ(departure->due, due);
    ASSERT_EQ(departure->tag, i);
  }
}

TEST(Flight, ADroppedDatagramDoesNotLeaveAndADuplicateLeavesTwice) {
  Flight<int> flight;
  Decision drop = passes(1ms);
  drop.verdict = Verdict::kDrop;
  EXPECT_TRUE(flight.launch(drop, bytes("lost"), 1));
  Decision twice = passes(1ms);
  twice.verdict = Verdict::kDuplicate;
  twice.duplicate = kStart + 3ms;
  flight.launch(twice, bytes("twice"), 2);
  flight.launch(passes(2ms), bytes("newer"), 3);
  EXPECT_EQ(departures(flight, kStart + 1s), (Lines{"2:twice", "3:newer", "2:twice'"}));
}

TEST(Flight, AStaleReplayIsTheDatagramThatManyBackEvenOneThatWasLost) {
  Flight<int> flight;
  History history;
  Decision drop = passes(0ms);
  drop.verdict = Verdict::kDrop;
  flight.launch(drop, bytes("zero"), 0, &history);
  flight.launch(passes(0ms), bytes("one"), 1, &history);
  Decision replays = passes(1ms);
  replays.stale = Decision::Stale{.release = kStart + 2ms, .back = 2};
  flight.launch(replays, bytes("two"), 2, &history);
  replays.stale = Decision::Stale{.release = kStart + 3ms, .back = 4};  // before the first datagram
  flight.launch(replays, bytes("three"), 3, &history);
  EXPECT_EQ(departures(flight, kStart + 1s), (Lines{"1:one", "2:two", "3:three", "2:zero\""}));
}

TEST(History, ReachesBackAsFarAsItsDepth) {
  History history;
  for (int i = 0; i < 100; ++i) history.remember(bytes(std::to_string(i)));
  const auto text = [&](std::size_t back) {
    const auto old = history.back(back);
    std::string result;
    if (old) {
      for (const std::byte b : *old) result += static_cast<char>(b);
    }
    return result;
  };
  EXPECT_EQ(text(1), "99");
  EXPECT_EQ(text(History::kDepth), "36");
  EXPECT_FALSE(history.back(History::kDepth + 1));
  EXPECT_FALSE(history.back(0));
}

TEST(Flight, DamageIsDoneToTheFirstCopyOnly) {
  Flight<int> flight;
  Decision damaged = passes(1ms);
  damaged.duplicate = kStart + 2ms;
  damaged.flipped_bit = 8 + 5;  // 'b' ^ 0x20
  damaged.truncated_to = 2;
  flight.launch(damaged, bytes("abc"), 1);
  EXPECT_EQ(departures(flight, kStart + 1s), (Lines{"1:aB", "1:abc'"}));
}

TEST(Flight, ABitThatIsNotThereIsNotFlipped) {
  Flight<int> flight;
  Decision damaged = passes(1ms);
  damaged.flipped_bit = 8 * 3;
  flight.launch(damaged, bytes("abc"), 1);
  damaged.flipped_bit = 0;
  damaged.truncated_to = 0;
  flight.launch(damaged, bytes("abc"), 2);
  EXPECT_EQ(departures(flight, kStart + 1s), (Lines{"1:abc", "2:"}));
}

TEST(Flight, EverySizeUpToTheLargestDatagramComesOutAsItWentIn) {
  Flight<int> flight;
  for (const std::size_t size : {0U, 1U, 63U, 64U, 65U, 128U, 129U, 1472U, 65'507U, 65'536U}) {
    std::vector<std::byte> datagram(size);
    for (std::size_t i = 0; i < size; ++i) datagram[i] = static_cast<std::byte>(i * 7);
    ASSERT_TRUE(flight.launch(passes(1ms), datagram, 1)) << size;
    const auto departure = flight.next_due(kStart + 1ms);
    ASSERT_TRUE(departure) << size;
    EXPECT_TRUE(std::ranges::equal(departure->datagram, datagram)) << size;
  }
  EXPECT_FALSE(flight.launch(passes(1ms), std::vector<std::byte>(65'537), 1));
}

TEST(Flight, RefusesWhatDoesNotFitAndTakesItAgainWhenThereIsRoom) {
  Flight<int> flight(5000);
  const std::vector<std::byte> large(2000);
  EXPECT_TRUE(flight.launch(passes(1ms), large, 1));
  EXPECT_TRUE(flight.launch(passes(2ms), large, 2));
  const std::size_t two = flight.bytes();
  EXPECT_LE(two, 5000U);
  Decision twice = passes(3ms);
  twice.duplicate = kStart + 3ms;
  EXPECT_FALSE(flight.launch(twice, large, 3));
  EXPECT_EQ(flight.bytes(), two);
  EXPECT_TRUE(flight.next_due(kStart + 1ms));
  EXPECT_TRUE(flight.launch(twice, large, 4)) << "the second copy does not fit and is left out";
  EXPECT_EQ(flight.size(), 2U);
  while (flight.next_due(kStart + 1s)) {
  }
  EXPECT_EQ(flight.bytes(), 0U);
  EXPECT_TRUE(flight.launch(passes(1ms), std::vector<std::byte>(100), 5));
  EXPECT_TRUE(flight.launch(passes(1ms), std::vector<std::byte>(4000), 6));
  EXPECT_EQ(flight.size(), 2U);
}

TEST(Flight, OnceWarmItUsesTheSameBuffersAgain) {
  Flight<int> flight;
  std::set<const std::byte*> seen;
  const auto fly = [&](int datagrams) {
    for (int i = 0; i < datagrams; ++i) flight.launch(passes(1ms), bytes(std::string(100, 'x')), i);
    while (const auto departure = flight.next_due(kStart + 1ms)) seen.insert(departure->datagram.data());
  };
  fly(50);
  EXPECT_EQ(seen.size(), 50U);
  for (int round = 1; round <= 50; ++round) fly(round);
  EXPECT_EQ(seen.size(), 50U);
}

TEST(Flight, TheBytesOfADepartureStayUntilTheNextLaunch) {
  Flight<int> flight;
  flight.launch(passes(1ms), bytes("first"), 1);
  flight.launch(passes(1ms), bytes("second"), 2);
  const auto first = flight.next_due(kStart + 1ms);
  const auto second = flight.next_due(kStart + 1ms);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(first->datagram.data()), 5), "first");
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(second->datagram.data()), 6), "second");
}

}  // namespace
}  // namespace tendon::injector::flight_test
