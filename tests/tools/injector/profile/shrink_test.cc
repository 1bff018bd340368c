// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/shrink.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::injector::shrink_test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kPackets = 1000;

Packet packet_of(std::uint64_t i) { return {.arrival = LocalTime(1ms * i), .size = 213, .bytes = {}}; }

Trace recorded(const char* profile) {
  Trace trace;
  Injector injector(parse_profile(profile), 7, 0, Direction::kUp);
  for (std::uint64_t i = 0; i < kPackets; ++i) {
    trace.records.push_back({injector.decide(packet_of(i)), Direction::kUp, 0, {}, {}});
  }
  return trace;
}

std::vector<Decision> played(const Trace& trace) {
  TracePlayer player(trace, Direction::kUp, 0, TracePlayer::By::kIndex);
  std::vector<Decision> decisions;
  for (std::uint64_t i = 0; i < kPackets; ++i) decisions.push_back(player.decide(packet_of(i)));
  return decisions;
}

bool lost(const std::vector<Decision>& decisions, std::size_t index) {
  return decisions[index].verdict == Verdict::kDrop;
}

std::set<std::uint64_t> indices(const Trace& trace) {
  std::set<std::uint64_t> all;
  for (const TraceRecord& record : trace.records) all.insert(record.index);
  return all;
}

Trace with_17_and_93_lost() {
  Trace trace = recorded("delay=lognormal(20ms,5ms) loss=10% duplicate=2%");
  for (const std::size_t index : {17U, 93U}) {
    trace.records[index].verdict = Verdict::kDrop;
    trace.records[index].duplicate.reset();
  }
  return trace;
}

bool needs_17_and_93(const Trace& trace) {
  const auto decisions = played(trace);
  return lost(decisions, 17) && lost(decisions, 93);
}

TEST(Shrink, FindsTheTwoDatagramsThatMatter) {
  const Shrunk shrunk = shrink(with_17_and_93_lost(), needs_17_and_93);
  EXPECT_EQ(indices(shrunk.trace), (std::set<std::uint64_t>{17, 93}));
  EXPECT_TRUE(shrunk.minimal);
  EXPECT_GT(shrunk.from, 950U);
  EXPECT_LE(shrunk.runs, 100U);
}

TEST(Shrink, TheResultFailsFromAFileToo) {
  const Shrunk shrunk = shrink(with_17_and_93_lost(), needs_17_and_93);
  std::stringstream file;
  write_trace(file, shrunk.trace);
  const Trace loaded = read_trace(file, "shrunk.csv");
  EXPECT_EQ(loaded, shrunk.trace);
  EXPECT_TRUE(needs_17_and_93(loaded));
}

TEST(Shrink, NoneOfWhatRemainsCanBeLeftOut) {
  // Fails with at least five lost datagrams whose index is divisible by 7, and one late datagram.
  const Trace failing = recorded("delay=lognormal(20ms,5ms) loss=30%");
  const auto fails = [](const Trace& trace) {
    const auto decisions = played(trace);
    int lost_sevens = 0;
    bool late = false;
    for (const Decision& decision : decisions) {
      lost_sevens += decision.verdict == Verdict::kDrop && decision.index % 7 == 0 ? 1 : 0;
      late = late || decision.release - decision.arrival > 35ms;
    }
    return lost_sevens >= 5 && late;
  };
  ASSERT_TRUE(fails(failing));
  const Shrunk shrunk = shrink(failing, fails);
  ASSERT_TRUE(shrunk.minimal);
  EXPECT_LE(shrunk.trace.records.size(), 6U);
  for (std::size_t i = 0; i < shrunk.trace.records.size(); ++i) {
    Trace less = shrunk.trace;
    less.records.erase(less.records.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(fails(less)) << i;
  }
}

TEST(Shrink, TheSameTraceGivesTheSameResultAndNumberOfRuns) {
  const Shrunk once = shrink(with_17_and_93_lost(), needs_17_and_93);
  const Shrunk again = shrink(with_17_and_93_lost(), needs_17_and_93);
  EXPECT_EQ(once.trace, again.trace);
  EXPECT_EQ(once.runs, again.runs);
}

TEST(Shrink, WhenTheRunsAreUsedUpTheBestSoFarStillFails) {
  for (std::size_t max_runs = 1; max_runs < 60; ++max_runs) {
    std::size_t counted = 0;
    const Shrunk shrunk = shrink(
        with_17_and_93_lost(),
        [&counted](const Trace& trace) {
          ++counted;
          return needs_17_and_93(trace);
        },
        max_runs);
    EXPECT_TRUE(needs_17_and_93(shrunk.trace));
    EXPECT_EQ(shrunk.runs, counted);
    EXPECT_LE(counted, max_runs);
    if (shrunk.minimal) {
      EXPECT_EQ(shrunk.trace.records.size(), 2U);
    }
  }
}

TEST(Shrink, WhenTheNetworkIsNotToBlameNothingRemains) {
  const Shrunk shrunk = shrink(with_17_and_93_lost(), [](const Trace&) { return true; });
  EXPECT_TRUE(shrunk.trace.records.empty());
  EXPECT_TRUE(shrunk.trace.sparse());
  EXPECT_TRUE(shrunk.minimal);
  EXPECT_EQ(shrunk.runs, 2U);
}

TEST(Shrink, ATraceThatDoesNotFailIsRefused) {
  EXPECT_THROW(shrink(with_17_and_93_lost(), [](const Trace&) { return false; }), std::invalid_argument);
}

TEST(Shrink, ASourcePortThatChangesOnceIsOneDatagram) {
  const Shrunk shrunk = shrink(recorded("delay=20ms rebind(every=300ms)"),
                               [](const Trace& trace) { return played(trace).back().rebinds >= 2; });
  // Three changes in a second; the second and the third each suffice to reach two changes.
  EXPECT_EQ(shrunk.from, 3U);
  EXPECT_EQ(shrunk.trace.records.size(), 1U);
}

TEST(Shrink, AShrunkTraceCanBeShrunkAgain) {
  const Shrunk once = shrink(with_17_and_93_lost(), needs_17_and_93);
  const Shrunk again = shrink(once.trace, [](const Trace& trace) { return lost(played(trace), 93); });
  EXPECT_EQ(again.from, 2U);
  EXPECT_EQ(indices(again.trace), std::set<std::uint64_t>{93});
  EXPECT_EQ(again.trace.benign, once.trace.benign);
}

}  // namespace
}  // namespace tendon::injector::shrink_test
