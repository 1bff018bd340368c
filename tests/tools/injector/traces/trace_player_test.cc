// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/trace_player.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector::trace_player_test {
namespace {

using namespace std::chrono_literals;
using By = TracePlayer::By;

LocalTime at(Duration since_zero) { return LocalTime(since_zero); }

Packet packet_of(std::uint64_t i) {
  const std::uint64_t jitter = one_of(200'000, Draws(1, 0, Direction::kUp)(Purpose::kDelay, i));
  return {.arrival = at(3s + 1ms * i + Duration(jitter)), .size = 213, .bytes = {}};
}

constexpr const char* kEverything =
    "base=2ms delay=lognormal(5ms,4ms) rho=0.8 loss=burst(3%,4) stall(every=700ms,for=60ms) outage(at=1s,for=90ms) "
    "duplicate=2% replay(1%,64) flip=1% truncate=1% rebind(every=900ms) jump(1%,3) rate=5Mbit/s queue=20packets";
constexpr const char* kInOrder = "delay=lognormal(5ms,4ms) rho=0.8 loss=burst(3%,4) duplicate=2%";

Trace recorded(const char* profile, std::uint64_t packets, std::vector<Direction> directions = {Direction::kUp}) {
  std::stringstream file;
  TraceHeader header;
  header.seed = 7;
  header.start = at(3s);
  header.up = profile;
  TraceWriter writer(file, header);
  for (const Direction direction : directions) {
    Injector injector(parse_profile(profile), 7, 0, direction);
    for (std::uint64_t i = 0; i < packets; ++i) {
      writer.write({injector.decide(packet_of(i)), direction, 0, {}, {}});
    }
  }
  return read_trace(file, "recorded");
}

TraceRecord delayed(std::uint64_t index, Duration arrival, Duration delay) {
  TraceRecord record;
  record.index = index;
  record.arrival = at(arrival);
  record.release = at(arrival + delay);
  return record;
}

TraceRecord lost(std::uint64_t index, Duration arrival) {
  TraceRecord record = delayed(index, arrival, 1ms);
  record.verdict = Verdict::kDrop;
  record.cause = Cause::kLoss;
  return record;
}

Trace of(std::vector<TraceRecord> records) {
  Trace trace;
  trace.records = std::move(records);
  return trace;
}

Duration delay_of(const Decision& decision) { return decision.release - decision.arrival; }

TEST(TracePlayer, TheSameTrafficMeetsTheSameFateInEveryBit) {
  for (const char* profile : {kEverything, kInOrder}) {
    const Trace trace = recorded(profile, 5000);
    for (const By by : {By::kIndex, By::kTime}) {
      TracePlayer player(trace, Direction::kUp, 0, by, at(3s));
      for (const TraceRecord& record : trace.records) {
        const Decision decision = player.decide(packet_of(record.index));
        ASSERT_EQ(decision, static_cast<const Decision&>(record)) << profile << " " << record.index;
      }
    }
  }
}

TEST(TracePlayer, EachDirectionHasItsOwnFates) {
  const Trace trace = recorded(kInOrder, 300, {Direction::kUp, Direction::kDown});
  TracePlayer down(trace, Direction::kDown, 0, By::kIndex);
  Injector original(parse_profile(kInOrder), 7, 0, Direction::kDown);
  for (std::uint64_t i = 0; i < 300; ++i) EXPECT_EQ(down.decide(packet_of(i)), original.decide(packet_of(i)));
}

TEST(TracePlayer, ByTimeTheNetworkIsBadAtTheSameTimesWhateverTheTraffic) {
  // 20 ms, then losses between 1 s and 2 s, then 5 ms; a record every 10 ms.
  Trace trace;
  trace.start = at(100s);
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Duration then = 100s + 10ms * i;
    trace.records.push_back(i >= 100 && i < 200 ? lost(i, then) : delayed(i, then, i < 100 ? 20ms : 5ms));
  }
  for (const Duration period : {Duration(1ms), Duration(7ms), Duration(33ms)}) {
    TracePlayer player(trace, Direction::kUp, 0, By::kTime, at(50s));
    for (Duration t{}; t < 3s; t += period) {
      const Decision decision = player.decide({.arrival = at(50s + t), .size = 9, .bytes = {}});
      EXPECT_EQ(decision.verdict == Verdict::kDrop, t >= 1s && t < 2s) << t.count();
      if (t < 1s) {
        EXPECT_EQ(delay_of(decision), 20ms);
      }
      if (t >= 2s) {
        EXPECT_EQ(delay_of(decision), 5ms);
      }
    }
  }
}

TEST(TracePlayer, ByIndexTheSameDatagramsAreLostWheneverTheyAreSent) {
  const Trace trace = recorded(kInOrder, 1000);
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  for (const TraceRecord& record : trace.records) {
    const Decision decision = player.decide({.arrival = at(9s + 3ms * record.index), .size = 9, .bytes = {}});
    EXPECT_EQ(decision.verdict, record.verdict);
  }
}

TEST(TracePlayer, WhatWasInOrderStaysInOrderWhenTheArrivalsAreOthers) {
  const Trace trace = recorded(kInOrder, 1000);
  for (const By by : {By::kIndex, By::kTime}) {
    TracePlayer player(trace, Direction::kUp, 0, by, at(3s));
    LocalTime newest = LocalTime::min();
    for (int i = 0; i < 5000; ++i) {
      const Decision decision = player.decide({.arrival = at(3s + 200us * i), .size = 9, .bytes = {}});
      if (decision.verdict == Verdict::kDrop) continue;
      EXPECT_GE(decision.release, newest);
      newest = decision.release;
      if (decision.duplicate) {
        EXPECT_GE(*decision.duplicate, decision.release);
      }
    }
  }
}

TEST(TracePlayer, ATraceThatReordersDoesSoAgain) {
  const Trace trace = of({delayed(0, 0ms, 9ms), delayed(1, 1ms, 2ms)});
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  EXPECT_EQ(player.decide({.arrival = at(5s), .size = 9, .bytes = {}}).release, at(5s + 9ms));
  EXPECT_EQ(player.decide({.arrival = at(5s + 1ms), .size = 9, .bytes = {}}).release, at(5s + 3ms));
}

TEST(TracePlayer, AfterItsEndATraceBeginsAgain) {
  const Trace trace = of({delayed(0, 0s, 10ms), lost(1, 1s), delayed(2, 2s, 12ms)});
  TracePlayer by_index(trace, Direction::kUp, 0, By::kIndex);
  TracePlayer by_time(trace, Direction::kUp, 0, By::kTime, at(7s));
  for (int i = 0; i < 9; ++i) {
    const TraceRecord& record = trace.records[static_cast<std::size_t>(i % 3)];
    const Packet packet{.arrival = at(7s + 1s * i), .size = 9, .bytes = {}};
    for (TracePlayer* player : {&by_index, &by_time}) {
      const Decision decision = player->decide(packet);
      EXPECT_EQ(decision.verdict, record.verdict);
      EXPECT_EQ(decision.release - decision.arrival, record.release - record.arrival);
      EXPECT_EQ(decision.index, static_cast<std::uint64_t>(i));
    }
  }
}

using AtEnd = TracePlayer::AtEnd;

TEST(TracePlayer, AfterItsEndATraceLetsAllPassIfSoAsked) {
  const Trace trace = of({delayed(0, 0ms, 5ms), delayed(1, 1ms, 9ms), lost(2, 2ms)});
  for (const By by : {By::kIndex, By::kTime}) {
    TracePlayer player(trace, Direction::kUp, 0, by, at(7s), AtEnd::kPass);
    std::string fates;
    for (int i = 0; i < 13; ++i) {
      EXPECT_FALSE(player.stops(at(7s + 1ms * i)));
      const Decision decision = player.decide({.arrival = at(7s + 1ms * i), .size = 1, .bytes = {}});
      fates += decision.verdict == Verdict::kDrop ? "x " : std::to_string(delay_of(decision) / 1ms) + " ";
    }
    // Not ahead of the second datagram, which leaves at 10 ms.
    EXPECT_EQ(fates, "5 9 x 7 6 5 4 3 2 1 0 0 0 ");
    EXPECT_EQ(player.played(), 1);
  }
}

TEST(TracePlayer, SaysWhereATraceEndsAndHowOftenItWasPlayed) {
  const Trace trace = of({delayed(0, 0ms, 5ms), delayed(1, 1ms, 5ms)});
  for (const By by : {By::kIndex, By::kTime}) {
    for (const AtEnd end : {AtEnd::kRepeat, AtEnd::kStop}) {
      TracePlayer player(trace, Direction::kUp, 0, by, at(0s), end);
      EXPECT_EQ(player.played(), 0);
      for (int i = 0; i < 7; ++i) {
        EXPECT_EQ(player.stops(at(1ms * i)), end == AtEnd::kStop && i >= 2) << i;
        player.decide({.arrival = at(1ms * i), .size = 1, .bytes = {}});
      }
      EXPECT_EQ(player.played(), end == AtEnd::kStop ? 1 : by == By::kIndex ? 3.5 : 3);
    }
  }
}

TEST(TracePlayer, AnAddedNetworkDelaysAndLosesAfterTheTrace) {
  const Trace trace = of({delayed(0, 0ms, 5ms), lost(1, 1ms), delayed(2, 2ms, 5ms), delayed(3, 3ms, 40ms)});
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  player.add(Injector(parse_profile("base=2ms loss=pattern(0010) step(at=20ms,10ms)"), 7, 0, Direction::kUp, at(0s)));
  std::string fates;
  for (int i = 0; i < 4; ++i) {
    const Decision decision = player.decide({.arrival = at(1ms * i), .size = 1, .bytes = {}});
    fates += decision.verdict == Verdict::kDrop ? "x " : std::to_string(delay_of(decision) / 1ms) + " ";
    EXPECT_EQ(decision.arrival, at(1ms * i));
    EXPECT_EQ(decision.index, static_cast<std::uint64_t>(i));
  }
  // The last one arrives at the network after its step.
  EXPECT_EQ(fates, "7 x x 52 ");
}

TEST(TracePlayer, AnAddedNetworkKeepsTheOrderFromTheReleaseOfTheTraceOn) {
  const Trace trace = recorded(kInOrder, 5000);
  const std::string profile = "delay=gamma(10ms,9ms) loss=5%";
  const auto played = [&](const std::string& added) {
    TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
    if (!added.empty()) player.add(Injector(parse_profile(added), 11, 0, Direction::kUp, at(3s)));
    std::vector<Decision> all;
    for (std::uint64_t i = 0; i < 5000; ++i) all.push_back(player.decide(packet_of(i)));
    return all;
  };
  const auto alone = played("");
  const auto free = played(profile + " order=free");
  const auto fifo = played(profile);
  LocalTime last = LocalTime::min();
  int both = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const bool lost_by_trace = alone[i].verdict == Verdict::kDrop;
    both += !lost_by_trace && fifo[i].verdict == Verdict::kDrop ? 1 : 0;
    EXPECT_EQ(fifo[i].verdict, free[i].verdict);
    if (lost_by_trace) {
      EXPECT_EQ(fifo[i].verdict, Verdict::kDrop);
      EXPECT_EQ(fifo[i].cause, alone[i].cause);
      continue;
    }
    EXPECT_GE(free[i].release, alone[i].release);
    EXPECT_GE(fifo[i].release, std::max(last, free[i].release)) << i;
    last = fifo[i].release;
  }
  EXPECT_GT(both, 150);
}

TEST(TracePlayer, TheLossesOfATraceDoNotMoveThoseOfAnAddedNetwork) {
  const auto played = [](const Trace& trace) {
    TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
    player.add(Injector(parse_profile("delay=uniform(0ms,9ms) loss=burst(10%,3) order=free"), 11, 0, Direction::kUp));
    std::vector<Decision> all;
    for (std::uint64_t i = 0; i < 2000; ++i) all.push_back(player.decide(packet_of(i)));
    return all;
  };
  const auto some = played(recorded("delay=5ms loss=20%", 2000));
  const auto none = played(recorded("delay=5ms", 2000));
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (some[i].verdict == Verdict::kPass) {
      EXPECT_EQ(some[i], none[i]);
    }
    if (some[i].cause != Cause::kLoss) {
      EXPECT_EQ(none[i].verdict, Verdict::kPass);
    }
  }
}

TEST(TracePlayer, TheRecordOfATraceWithAnAddedNetworkReplaysAlike) {
  for (const auto& [first, second] : {std::pair(kEverything, "order=free delay=gamma(9ms,9ms) loss=9% flip=2%"),
                                      std::pair(kInOrder, kEverything), std::pair(kInOrder, "duplicate=9%")}) {
    const Trace trace = recorded(first, 3000);
    EXPECT_EQ(reorders(trace, Direction::kUp), first == kEverything);
    TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
    player.add(Injector(parse_profile(second), 11, 0, Direction::kUp, at(3s)));
    std::stringstream file;
    TraceWriter writer(file, {});
    std::vector<Decision> decisions;
    for (std::uint64_t i = 0; i < 3000; ++i) {
      decisions.push_back(player.decide(packet_of(i)));
      writer.write({decisions.back(), Direction::kUp, 0, {}, {}});
    }
    const Trace record = read_trace(file, "record");
    TracePlayer again(record, Direction::kUp, 0, By::kIndex);
    for (std::uint64_t i = 0; i < 3000; ++i) ASSERT_EQ(again.decide(packet_of(i)), decisions[i]) << second << i;
  }
}

TEST(TracePlayer, TheSourcePortGoesOnChangingWhenTheTraceBeginsAgain) {
  Trace trace = of({delayed(0, 0s, 1ms), delayed(1, 1s, 1ms), delayed(2, 2s, 1ms)});
  trace.records[1].rebinds = 1;
  trace.records[2].rebinds = 2;
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  std::vector<std::uint32_t> rebinds;
  for (int i = 0; i < 6; ++i) rebinds.push_back(player.decide({.arrival = at(1s * i), .size = 9, .bytes = {}}).rebinds);
  EXPECT_EQ(rebinds, (std::vector<std::uint32_t>{0, 1, 2, 2, 3, 4}));
}

TEST(TracePlayer, ADatagramThatWasNotRecordedTakesTheMedianDelay) {
  const Trace trace = of({delayed(0, 0ms, 10ms), delayed(1, 20ms, 14ms), delayed(4, 80ms, 30ms), lost(5, 100ms)});
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  std::vector<Duration> delays;
  for (int i = 0; i < 5; ++i) {
    const Decision decision = player.decide({.arrival = at(20ms * i), .size = 9, .bytes = {}});
    EXPECT_EQ(decision.verdict, Verdict::kPass);
    EXPECT_EQ(decision.cause == Cause::kReplay, i == 2 || i == 3);
    delays.push_back(delay_of(decision));
  }
  EXPECT_EQ(delays, (std::vector<Duration>{10ms, 14ms, 14ms, 14ms, 30ms}));
}

TEST(TracePlayer, InASparseTraceAllThatIsNotListedIsBenignForEver) {
  Trace trace = of({lost(2, 0ms), delayed(5, 0ms, 40ms)});
  trace.benign[0] = 10ms;
  TracePlayer player(trace, Direction::kUp, 0, By::kIndex);
  for (int i = 0; i < 100; ++i) {
    const Decision decision = player.decide({.arrival = at(1ms * i), .size = 9, .bytes = {}});
    EXPECT_EQ(decision.verdict == Verdict::kDrop, i == 2);
    if (i == 2) continue;
    EXPECT_EQ(decision.release, i >= 5 && i < 35 ? at(45ms) : at(1ms * i + 10ms)) << i;
  }
}

TEST(TracePlayer, ASparseTraceByTimeIsRefused) {
  Trace trace;
  trace.benign[0] = 10ms;
  EXPECT_THROW(TracePlayer(trace, Direction::kUp, 0, By::kTime), std::invalid_argument);
}

TEST(TracePlayer, LinksThatWereNotRecordedShareThoseThatWere) {
  Trace trace = of({delayed(0, 0ms, 10ms), delayed(0, 0ms, 20ms)});
  trace.records[0].link = 4;
  trace.records[1].link = 7;
  for (const auto& [link, delay] : {std::pair{4U, 10ms}, {7U, 20ms}, {0U, 10ms}, {1U, 20ms}, {2U, 10ms}}) {
    TracePlayer player(trace, Direction::kUp, link, By::kIndex);
    EXPECT_EQ(delay_of(player.decide({.arrival = at(1s), .size = 9, .bytes = {}})), delay) << link;
  }
}

TEST(TracePlayer, ADirectionThatWasNotRecordedPassesWithoutDelay) {
  const Trace trace = of({delayed(0, 0ms, 10ms)});
  for (const By by : {By::kIndex, By::kTime}) {
    TracePlayer player(trace, Direction::kDown, 0, by);
    EXPECT_EQ(delay_of(player.decide({.arrival = at(1s), .size = 9, .bytes = {}})), 0ms);
  }
}

}  // namespace
}  // namespace tendon::injector::trace_player_test
