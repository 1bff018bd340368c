// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/proxy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::injector::proxy_test {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);

constexpr Address loopback(std::uint16_t port) {
  return {.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1}, .port = port};
}
constexpr Address kA = loopback(50001);
constexpr Address kZ = loopback(50002);

std::vector<std::byte> bytes(const std::string& text) {
  std::vector<std::byte> result;
  for (const char c : text) result.push_back(static_cast<std::byte>(c));
  return result;
}

std::string text(std::span<const std::byte> datagram) {
  std::string result;
  for (const std::byte b : datagram) result += static_cast<char>(b);
  return result;
}

Proxy::Config config(const std::string& up, const std::string& down) {
  return {.networks = {Injector(parse_profile(up), 7, 0, Direction::kUp),
                       Injector(parse_profile(down), 7, 0, Direction::kDown)}};
}

/// The departures until `now`, as "payload@ms after the start>destination".
std::vector<std::string> departures(Proxy& proxy, LocalTime now) {
  std::vector<std::string> result;
  while (const auto d = proxy.next_due(now)) {
    const bool up = d->record.direction == Direction::kUp;
    const std::string where = up ? "server" : d->to == kA ? "A" : d->to == kZ ? "Z" : "?";
    result.push_back(text(d->datagram) + "@" + std::to_string((d->due - kStart) / 1ms) + ">" + where);
    proxy.left(*d, now);
  }
  return result;
}

using Lines = std::vector<std::string>;

TEST(Proxy, DelaysEachDirectionByItsOwnProfile) {
  Proxy proxy(config("delay=20ms", "delay=30ms"));
  const auto a = proxy.receive_from_client(kA, bytes("hello"), kStart);
  ASSERT_TRUE(a);
  proxy.receive_from_server(*a, bytes("retry"), kStart + 1ms);
  EXPECT_EQ(proxy.next_wake(), kStart + 20ms);
  EXPECT_EQ(departures(proxy, kStart + 20ms - 1ns), Lines{});
  EXPECT_EQ(departures(proxy, kStart + 20ms), Lines{"hello@20>server"});
  EXPECT_EQ(proxy.next_wake(), kStart + 31ms);
  EXPECT_EQ(departures(proxy, kStart + 1s), Lines{"retry@31>A"});
}

TEST(Proxy, BringsAnswersOnlyToTheClientTheyAreFor) {
  Proxy proxy(config("", "delay=10ms"));
  const auto a = proxy.receive_from_client(kA, bytes("a"), kStart);
  const auto z = proxy.receive_from_client(kZ, bytes("z"), kStart);
  ASSERT_TRUE(a && z);
  EXPECT_NE(*a, *z);
  EXPECT_EQ(proxy.receive_from_client(kA, bytes("a2"), kStart), a);
  EXPECT_EQ(departures(proxy, kStart), (Lines{"a@0>server", "z@0>server", "a2@0>server"}));
  proxy.receive_from_server(*z, bytes("for z"), kStart);
  proxy.receive_from_server(*a, bytes("for a"), kStart);
  EXPECT_EQ(departures(proxy, kStart + 10ms), (Lines{"for z@10>Z", "for a@10>A"}));
}

/// The fates of A's datagrams up, one per ms, while `disturb` interferes with the proxy.
template <typename Disturb>
Lines fates_of_a(Disturb disturb) {
  Proxy proxy(config("delay=uniform(5ms,35ms) loss=20% duplicate=10%", "delay=uniform(5ms,35ms) loss=20%"));
  Lines result;
  for (int i = 0; i < 500; ++i) {
    const LocalTime now = kStart + i * 1ms;
    const auto a = proxy.receive_from_client(kA, bytes("a" + std::to_string(i)), now);
    disturb(proxy, *a, now);
    for (const std::string& line : departures(proxy, now)) {
      if (line.starts_with("a")) result.push_back(line);
    }
  }
  return result;
}

TEST(Proxy, WhatOneClientOrDirectionDoesNeverChangesTheFatesOfAnother) {
  const Lines alone = fates_of_a([](Proxy&, ClientIndex, LocalTime) {});
  EXPECT_GT(alone.size(), 350U);
  EXPECT_EQ(alone, fates_of_a([](Proxy& proxy, ClientIndex, LocalTime now) {
              proxy.receive_from_client(kZ, bytes("z"), now);
              proxy.receive_from_client(kZ, bytes("z"), now);
            }));
  EXPECT_EQ(alone, fates_of_a([](Proxy& proxy, ClientIndex a, LocalTime now) {
              proxy.receive_from_server(a, bytes("down"), now);
            }));
}

TEST(Proxy, TheTwoDirectionsAndTwoClientsMeetDifferentFates) {
  Proxy proxy(config("loss=50%", "loss=50%"));
  std::array<std::string, 4> fates;
  for (int i = 0; i < 64; ++i) {
    const auto a = proxy.receive_from_client(kA, bytes("0"), kStart);
    const auto z = proxy.receive_from_client(kZ, bytes("1"), kStart);
    proxy.receive_from_server(*a, bytes("2"), kStart);
    proxy.receive_from_server(*z, bytes("3"), kStart);
    std::array<bool, 4> came{};
    while (const auto d = proxy.next_due(kStart)) came.at(static_cast<std::size_t>(d->datagram[0]) - '0') = true;
    for (std::size_t k = 0; k < 4; ++k) fates.at(k) += came.at(k) ? "+" : "-";
  }
  EXPECT_EQ(std::set<std::string>(fates.begin(), fates.end()).size(), 4U);
}

TEST(Proxy, CanBeReplayedInProcessFromItsSeed) {
  Proxy proxy(config("delay=uniform(15ms,25ms) loss=20%", ""));
  Injector injector(parse_profile("delay=uniform(15ms,25ms) loss=20%"), 7, 0, Direction::kUp);
  Lines expected;
  for (int i = 0; i < 200; ++i) {
    const LocalTime now = kStart + i * 1ms;
    proxy.receive_from_client(kA, bytes("a"), now);
    const Decision decision = injector.decide({now, 1, {}});
    if (decision.verdict == Verdict::kDrop) continue;
    expected.push_back("a@" + std::to_string((decision.release - kStart) / 1ms) + ">server");
  }
  EXPECT_EQ(departures(proxy, kStart + 1s), expected);
}

TEST(Proxy, RefusesClientsBeyondItsLimitAndKeepsThoseItHas) {
  Proxy::Config o = config("", "");
  o.max_clients = 1;
  Proxy proxy(o);
  EXPECT_TRUE(proxy.receive_from_client(kA, bytes("a"), kStart));
  EXPECT_FALSE(proxy.receive_from_client(kZ, bytes("z"), kStart));
  EXPECT_TRUE(proxy.receive_from_client(kA, bytes("a"), kStart));
  EXPECT_EQ(departures(proxy, kStart), (Lines{"a@0>server", "a@0>server"}));
  EXPECT_EQ(proxy.measurements(Direction::kUp).counters.refused_clients, 1U);
}

TEST(Proxy, ForgetsAnIdleClientAndGivesANewIndexWhenItReturns) {
  Proxy::Config o = config("", "");
  o.max_clients = 1;
  Proxy proxy(o);
  const auto first = proxy.receive_from_client(kA, bytes("a"), kStart);
  departures(proxy, kStart);
  EXPECT_EQ(proxy.next_wake(), kStart + 30s);
  EXPECT_FALSE(proxy.next_evicted(kStart + 30s - 1ns));
  EXPECT_EQ(proxy.next_evicted(kStart + 30s), first);
  EXPECT_FALSE(proxy.next_evicted(kStart + 30s));
  EXPECT_EQ(proxy.clients().size(), 0U);
  EXPECT_EQ(proxy.next_wake(), std::nullopt);

  proxy.receive_from_server(*first, bytes("too late"), kStart + 30s);
  EXPECT_EQ(proxy.measurements(Direction::kDown).counters.refused_clients, 1U);
  const auto again = proxy.receive_from_client(kA, bytes("a"), kStart + 31s);
  ASSERT_TRUE(again);
  EXPECT_NE(*again, *first);
}

TEST(Proxy, DoesNotForgetAClientWhileADatagramIsOnItsWay) {
  Proxy proxy(config("delay=60s", ""));
  const auto a = proxy.receive_from_client(kA, bytes("a"), kStart);
  EXPECT_FALSE(proxy.next_evicted(kStart + 59s));
  EXPECT_EQ(proxy.next_wake(), kStart + 60s);
  EXPECT_EQ(departures(proxy, kStart + 60s), Lines{"a@60000>server"});
  EXPECT_EQ(proxy.next_evicted(kStart + 60s), a);
}

TEST(Proxy, RefusesWhatDoesNotFitIntoItsMemory) {
  Proxy::Config o = config("delay=10ms", "");
  o.max_bytes_in_flight = 6000;
  Proxy proxy(o);
  const std::vector<std::byte> large(1200);
  for (int i = 0; i < 5; ++i) proxy.receive_from_client(kA, large, kStart);
  EXPECT_EQ(proxy.in_flight(), 2U);
  EXPECT_EQ(proxy.measurements(Direction::kUp).counters.refused_full, 3U);
  EXPECT_EQ(departures(proxy, kStart + 10ms).size(), 2U);
  proxy.receive_from_client(kA, large, kStart + 10ms);
  EXPECT_EQ(proxy.in_flight(), 1U);
}

TEST(Proxy, EveryDatagramIsAccountedFor) {
  Proxy::Config o = config("delay=uniform(5ms,35ms) loss=20% duplicate=10% replay(5%,8) outage(at=100ms,for=50ms)", "");
  o.max_bytes_in_flight = 6'000;  // to refuse some
  Proxy proxy(o);
  std::uint64_t left = 0;
  for (int i = 0; i < 1000; ++i) {
    proxy.receive_from_client(kA, bytes("a"), kStart + i * 1ms);
    left += departures(proxy, kStart + i * 1ms).size();
  }
  left += departures(proxy, kStart + 10s).size();
  const ProxyMeasurements& measured = proxy.measurements(Direction::kUp);
  const ProxyCounters& n = measured.counters;
  EXPECT_EQ(n.received, 1000U);
  EXPECT_EQ(n.received, n.lost() + n.forwarded + n.refused_full);
  EXPECT_EQ(n.dropped[static_cast<std::size_t>(Cause::kOutage)], 50U);
  EXPECT_EQ(n.lost(), 50U + n.dropped[static_cast<std::size_t>(Cause::kLoss)]);
  EXPECT_EQ(left, n.forwarded + n.duplicated + n.replayed);
  EXPECT_EQ(measured.delay.count(), n.forwarded);
  EXPECT_EQ(measured.release_error.count(), left);
  EXPECT_GT(n.refused_full, 0U);
  EXPECT_GT(n.duplicated, 20U);
  EXPECT_GT(n.replayed, 5U);
  EXPECT_EQ(proxy.in_flight(), 0U);
}

TEST(Proxy, WhatTheKernelDoesNotTakeIsCountedAndNotMeasured) {
  Proxy proxy(config("", ""));
  proxy.receive_from_client(kA, bytes("a"), kStart);
  const auto departure = proxy.next_due(kStart);
  ASSERT_TRUE(departure);
  proxy.not_sent(*departure);
  const ProxyMeasurements& measured = proxy.measurements(Direction::kUp);
  EXPECT_EQ(measured.counters.unsent, 1U);
  EXPECT_EQ(measured.counters.forwarded, 0U);
  EXPECT_EQ(measured.release_error.count(), 0U);
}

TEST(Proxy, MeasuresHowLateDatagramsLeftAndHowLongTheyReallyTook) {
  Proxy proxy(config("delay=20ms", ""));
  proxy.receive_from_client(kA, bytes("a"), kStart);
  const auto departure = proxy.next_due(kStart + 21ms);
  ASSERT_TRUE(departure);
  proxy.left(*departure, kStart + 23ms);
  const ProxyMeasurements& measured = proxy.measurements(Direction::kUp);
  EXPECT_EQ(measured.release_error.max(), 3ms);
  EXPECT_EQ(measured.delay.max(), 23ms);
}

TEST(Proxy, ATimelineCountsFromTheFirstDatagramWheneverItIsAsked) {
  Proxy::Config o = config("delay=1ms", "delay=1ms");
  Proxy::PreparedChange slow;
  slow.to[0].emplace(parse_profile("delay=50ms"), 7, 0, Direction::kUp);
  slow.text = "up delay=50ms";
  o.timeline.push_back({10ms, slow});
  Proxy proxy(o);
  proxy.follow_timeline(kStart + 5s);  // no client yet, so the timeline has not started
  EXPECT_EQ(proxy.steps_done(), 0U);
  const LocalTime first = kStart + 6s;
  const auto a = proxy.receive_from_client(kA, bytes("0"), first);
  proxy.receive_from_client(kA, bytes("1"), first + 10ms - 1ns);
  proxy.receive_from_client(kA, bytes("2"), first + 10ms);
  proxy.receive_from_server(*a, bytes("3"), first + 10ms);
  EXPECT_EQ(departures(proxy, first + 1s), (Lines{"0@6001>server", "1@6010>server", "3@6011>A", "2@6060>server"}));
  EXPECT_EQ(proxy.steps_done(), 1U);
  EXPECT_EQ(proxy.last_change(), "up delay=50ms");
}

TEST(Proxy, TheTimesOfAStepCountFromTheStepNotFromItsFirstDatagram) {
  Proxy::Config o = config("", "");
  Proxy::PreparedChange outage;
  outage.to[0].emplace(parse_profile("outage(at=5ms,for=5ms)"), 7, 0, Direction::kUp);
  o.timeline.push_back({10ms, outage});
  Proxy proxy(o);
  for (const Duration at : {0ms, 12ms, 16ms, 20ms}) proxy.receive_from_client(kA, bytes("a"), kStart + at);
  EXPECT_EQ(departures(proxy, kStart + 1s), (Lines{"a@0>server", "a@12>server", "a@20>server"}));
}

TEST(Proxy, AChangeForOneClientIsForThatClientEvenBeforeItComes) {
  Proxy proxy(config("delay=1ms", ""));
  Proxy::PreparedChange slow;
  slow.client = 1;
  slow.to[0].emplace(parse_profile("delay=50ms"), 7, 0, Direction::kUp);
  proxy.change(slow, kStart);
  proxy.receive_from_client(kA, bytes("a"), kStart);
  proxy.receive_from_client(kZ, bytes("z"), kStart);
  EXPECT_EQ(departures(proxy, kStart + 1s), (Lines{"a@1>server", "z@50>server"}));
  slow.client.reset();
  slow.to[0].emplace(parse_profile("delay=5ms"), 7, 0, Direction::kUp);
  proxy.change(slow, kStart + 1s);
  proxy.receive_from_client(kA, bytes("a"), kStart + 1s);
  proxy.receive_from_client(kZ, bytes("z"), kStart + 1s);
  EXPECT_EQ(departures(proxy, kStart + 2s), (Lines{"a@1005>server", "z@1005>server"}));
}

TEST(Proxy, AnOutageHitsAllClientsAtTheSameTimeWheneverTheyCame) {
  Proxy proxy(config("outage(at=10ms,for=5ms)", ""));
  proxy.receive_from_client(kA, bytes("a"), kStart);
  proxy.receive_from_client(kZ, bytes("z"), kStart + 8ms);
  for (const Address& client : {kA, kZ}) {
    proxy.receive_from_client(client, bytes("lost"), kStart + 12ms);
    proxy.receive_from_client(client, bytes("b"), kStart + 15ms);
  }
  EXPECT_EQ(departures(proxy, kStart + 1s), (Lines{"a@0>server", "z@8>server", "b@15>server", "b@15>server"}));
}

/// Each of the 300 datagrams is sent 7 µs after its release time.
struct Recorded {
  Lines left;
  Trace trace;
};
Recorded run(Proxy::Config o, LocalTime begin) {
  o.record = true;
  Proxy proxy(o);
  Recorded result;
  for (int i = 0; i < 1300; ++i) {
    const LocalTime now = begin + i * 1ms;
    if (i < 300) {
      const auto a = proxy.receive_from_client(kA, bytes("u" + std::to_string(i)), now);
      if (i % 3 == 0) proxy.receive_from_client(kZ, bytes("z" + std::to_string(i)), now);
      proxy.receive_from_server(*a, bytes("d" + std::to_string(i)), now);
    }
    while (const auto d = proxy.next_due(now)) {
      result.left.push_back(text(d->datagram) + "@" + std::to_string((d->due - begin).count()) +
                            (d->copy == Copy::kFirst ? "" : " again"));
      proxy.left(*d, now + 7us);
    }
  }
  result.trace.records = proxy.records();
  return result;
}

TEST(Proxy, ReplayingARecordedRunGivesTheSameFatesAndTheSameTrace) {
  const std::string up = "delay=uniform(5ms,35ms) loss=10% duplicate=5% replay(5%,8) flip=5% truncate=5%";
  const Recorded recorded = run(config(up, "delay=20ms loss=burst(5%,3)"), kStart);
  ASSERT_EQ(recorded.trace.records.size(), 700U);

  Proxy::Config o = config("", "");
  o.replay = &recorded.trace;
  const Recorded replayed = run(o, kStart + 77s);
  EXPECT_EQ(replayed.left, recorded.left);
  EXPECT_EQ(replayed.trace.records, recorded.trace.records);
}

TEST(Proxy, WhenTheTraceEndsTheRestIsIgnoredAndWhatIsInFlightStillLeaves) {
  const Recorded recorded = run(config("delay=50ms", "delay=20ms"), kStart);
  Proxy::Config o = config("", "");
  o.replay = &recorded.trace;
  o.playback.at_end = TracePlayer::AtEnd::kStop;
  Proxy proxy(o);
  LocalTime now = kStart;
  for (int i = 0; i < 300; ++i, now += 1ms) proxy.receive_from_client(kA, bytes("u"), now);
  EXPECT_FALSE(proxy.ended());
  EXPECT_EQ(proxy.measurements(Direction::kUp).played, 1);
  proxy.receive_from_client(kA, bytes("late"), now);
  EXPECT_TRUE(proxy.ended());
  proxy.receive_from_server(0, bytes("d"), now);
  EXPECT_EQ(proxy.measurements(Direction::kUp).counters.after_end, 1U);
  EXPECT_EQ(proxy.measurements(Direction::kDown).counters.after_end, 1U);
  EXPECT_EQ(departures(proxy, now + 1s).size(), 300U);
  EXPECT_EQ(proxy.in_flight(), 0U);
}

TEST(Proxy, ANetworkAddedToATraceHasOtherRandomNumbersForEachClient) {
  const Recorded recorded = run(config("", ""), kStart);
  Proxy::Config o = config("loss=50%", "loss=50%");
  o.replay = &recorded.trace;
  o.playback.add = true;
  const Recorded added = run(o, kStart);
  std::array<std::string, 3> fates;
  for (const TraceRecord& record : added.trace.records) {
    fates[record.direction == Direction::kDown ? 2 : record.link] += record.verdict == Verdict::kDrop ? '-' : '+';
  }
  for (const std::string& fate : fates) EXPECT_GT(std::ranges::count(fate, '-'), 20) << fate;
  EXPECT_NE(fates[0].substr(0, 100), fates[1].substr(0, 100));
  EXPECT_NE(fates[0].substr(0, 100), fates[2].substr(0, 100));
}

TEST(Proxy, ARecordSaysWhatWasPlannedAndWhatHappenedSinceTheFirstDatagram) {
  Proxy::Config o = config("delay=20ms", "loss=100%");
  o.record = true;
  Proxy proxy(o);
  const auto a = proxy.receive_from_client(kA, bytes("abc"), kStart);
  proxy.receive_from_server(*a, bytes("d"), kStart + 3ms);
  departures(proxy, kStart + 22ms);
  ASSERT_EQ(proxy.records().size(), 2U);
  const TraceRecord& lost = proxy.records()[0];
  EXPECT_EQ(lost.direction, Direction::kDown);
  EXPECT_EQ(lost.verdict, Verdict::kDrop);
  EXPECT_EQ(lost.arrival, LocalTime(3ms));
  EXPECT_FALSE(lost.actual);
  const TraceRecord& passed = proxy.records()[1];
  EXPECT_EQ(passed.direction, Direction::kUp);
  EXPECT_EQ(passed.arrival, LocalTime(0ms));
  EXPECT_EQ(passed.release, LocalTime(20ms));
  EXPECT_EQ(passed.actual, LocalTime(22ms));
  EXPECT_EQ(passed.payload_hash, payload_hash(bytes("abc")));
}

}  // namespace
}  // namespace tendon::injector::proxy_test
