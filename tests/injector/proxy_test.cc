// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/proxy.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);

constexpr Address loopback(std::uint16_t port) {
  return {.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1}, .port = port};
}
constexpr Address kServer = loopback(47100);
constexpr Address kA = loopback(50001);
constexpr Address kZ = loopback(50002);

std::vector<std::byte> bytes(const std::string& text) {
  std::vector<std::byte> result;
  for (const char c : text) result.push_back(static_cast<std::byte>(c));
  return result;
}

std::string text(const std::vector<std::byte>& datagram) {
  std::string result;
  for (const std::byte b : datagram) result += static_cast<char>(b);
  return result;
}

ProxyOptions options(const std::string& up, const std::string& down) {
  ProxyOptions result;
  result.server = kServer;
  result.up = parse_profile(up);
  result.down = parse_profile(down);
  result.seed = 7;
  return result;
}

/// Everything that leaves up to `now`, as "payload@ms after the start>where".
std::vector<std::string> departures(Proxy& proxy, LocalTime now) {
  std::vector<std::string> result;
  while (const auto d = proxy.next_due(now)) {
    const std::string where = d->to == kServer ? "server" : d->to == kA ? "A" : d->to == kZ ? "Z" : "?";
    result.push_back(text(d->datagram) + "@" + std::to_string((d->due - kStart) / 1ms) + ">" + where);
  }
  return result;
}

using Lines = std::vector<std::string>;

TEST(Proxy, DelaysEachDirectionByItsOwnProfile) {
  Proxy proxy(options("delay=20ms", "delay=30ms"));
  const auto a = proxy.receive_from_client(kA, bytes("hello"), kStart);
  ASSERT_TRUE(a);
  proxy.receive_from_server(*a, kServer, bytes("retry"), kStart + 1ms);
  EXPECT_EQ(proxy.next_wake(), kStart + 20ms);
  EXPECT_EQ(departures(proxy, kStart + 20ms - 1ns), Lines{});
  EXPECT_EQ(departures(proxy, kStart + 20ms), Lines{"hello@20>server"});
  EXPECT_EQ(proxy.next_wake(), kStart + 31ms);
  EXPECT_EQ(departures(proxy, kStart + 1s), Lines{"retry@31>A"});
}

TEST(Proxy, BringsAnswersOnlyToTheClientTheyAreFor) {
  Proxy proxy(options("", "delay=10ms"));
  const auto a = proxy.receive_from_client(kA, bytes("a"), kStart);
  const auto z = proxy.receive_from_client(kZ, bytes("z"), kStart);
  ASSERT_TRUE(a && z);
  EXPECT_NE(*a, *z);
  EXPECT_EQ(proxy.receive_from_client(kA, bytes("a2"), kStart), a);
  EXPECT_EQ(departures(proxy, kStart), (Lines{"a@0>server", "z@0>server", "a2@0>server"}));
  proxy.receive_from_server(*z, kServer, bytes("for z"), kStart);
  proxy.receive_from_server(*a, kServer, bytes("for a"), kStart);
  EXPECT_EQ(departures(proxy, kStart + 10ms), (Lines{"for z@10>Z", "for a@10>A"}));
}

/// The fates of A's datagrams up, one each ms, while `disturb` does what it likes to the proxy.
template <typename Disturb>
Lines fates_of_a(Disturb disturb) {
  Proxy proxy(options("delay=uniform(5ms,35ms) loss=20% duplicate=10%", "delay=uniform(5ms,35ms) loss=20%"));
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
              proxy.receive_from_server(a, kServer, bytes("down"), now);
            }));
}

TEST(Proxy, TheTwoDirectionsAndTwoClientsMeetDifferentFates) {
  Proxy proxy(options("loss=50%", "loss=50%"));
  std::array<std::string, 4> fates;
  for (int i = 0; i < 64; ++i) {
    const auto a = proxy.receive_from_client(kA, bytes("0"), kStart);
    const auto z = proxy.receive_from_client(kZ, bytes("1"), kStart);
    proxy.receive_from_server(*a, kServer, bytes("2"), kStart);
    proxy.receive_from_server(*z, kServer, bytes("3"), kStart);
    std::array<bool, 4> came{};
    while (const auto d = proxy.next_due(kStart)) came.at(static_cast<std::size_t>(d->datagram[0]) - '0') = true;
    for (std::size_t k = 0; k < 4; ++k) fates.at(k) += came.at(k) ? "+" : "-";
  }
  EXPECT_EQ(std::set<std::string>(fates.begin(), fates.end()).size(), 4U);
}

TEST(Proxy, CanBeReplayedInProcessFromItsSeed) {
  const ProxyOptions o = options("delay=uniform(15ms,25ms) loss=20%", "");
  Proxy proxy(o);
  Injector injector(o.up, o.seed, 0, Direction::kUp);
  Lines expected;
  for (int i = 0; i < 200; ++i) {
    const LocalTime now = kStart + i * 1ms;
    proxy.receive_from_client(kA, bytes("a"), now);
    const Decision d = injector.decide({.arrival = now, .size = 1});
    if (d.verdict == Verdict::kPass) expected.push_back("a@" + std::to_string((d.release - kStart) / 1ms) + ">server");
  }
  EXPECT_EQ(departures(proxy, kStart + 1s), expected);
}

TEST(Proxy, TakesNothingOnAClientsSocketThatIsNotFromTheServer) {
  Proxy proxy(options("", ""));
  const auto a = proxy.receive_from_client(kA, bytes("a"), kStart);
  departures(proxy, kStart);
  proxy.receive_from_server(*a, kZ, bytes("forged"), kStart);
  EXPECT_EQ(departures(proxy, kStart + 1s), Lines{});
  EXPECT_EQ(proxy.counters(Direction::kDown).refused, 1U);
}

TEST(Proxy, RefusesClientsBeyondItsLimitAndKeepsThoseItHas) {
  ProxyOptions o = options("", "");
  o.max_clients = 1;
  Proxy proxy(o);
  EXPECT_TRUE(proxy.receive_from_client(kA, bytes("a"), kStart));
  EXPECT_FALSE(proxy.receive_from_client(kZ, bytes("z"), kStart));
  EXPECT_TRUE(proxy.receive_from_client(kA, bytes("a"), kStart));
  EXPECT_EQ(departures(proxy, kStart), (Lines{"a@0>server", "a@0>server"}));
  EXPECT_EQ(proxy.counters(Direction::kUp).refused, 1U);
}

TEST(Proxy, ForgetsAnIdleClientAndGivesANewIndexWhenItReturns) {
  ProxyOptions o = options("", "");
  o.max_clients = 1;
  Proxy proxy(o);
  const auto first = proxy.receive_from_client(kA, bytes("a"), kStart);
  departures(proxy, kStart);
  EXPECT_EQ(proxy.next_wake(), kStart + 30s);
  EXPECT_FALSE(proxy.next_evicted(kStart + 30s - 1ns));
  EXPECT_EQ(proxy.next_evicted(kStart + 30s), first);
  EXPECT_FALSE(proxy.next_evicted(kStart + 30s));
  EXPECT_EQ(proxy.clients(), 0U);
  EXPECT_EQ(proxy.next_wake(), std::nullopt);

  proxy.receive_from_server(*first, kServer, bytes("too late"), kStart + 30s);
  EXPECT_EQ(proxy.counters(Direction::kDown).refused, 1U);
  const auto again = proxy.receive_from_client(kA, bytes("a"), kStart + 31s);
  ASSERT_TRUE(again);
  EXPECT_NE(*again, *first);
}

TEST(Proxy, DoesNotForgetAClientWhileADatagramIsOnItsWay) {
  Proxy proxy(options("delay=60s", ""));
  const auto a = proxy.receive_from_client(kA, bytes("a"), kStart);
  EXPECT_FALSE(proxy.next_evicted(kStart + 59s));
  EXPECT_EQ(proxy.next_wake(), kStart + 60s);
  EXPECT_EQ(departures(proxy, kStart + 60s), Lines{"a@60000>server"});
  EXPECT_EQ(proxy.next_evicted(kStart + 60s), a);
}

TEST(Proxy, RefusesWhatDoesNotFitIntoItsMemory) {
  ProxyOptions o = options("delay=10ms", "");
  o.max_bytes_in_flight = 3000;
  Proxy proxy(o);
  const std::vector<std::byte> large(1200);
  for (int i = 0; i < 5; ++i) proxy.receive_from_client(kA, large, kStart);
  EXPECT_EQ(proxy.in_flight(), 2U);
  EXPECT_EQ(proxy.counters(Direction::kUp).refused, 3U);
  EXPECT_EQ(departures(proxy, kStart + 10ms).size(), 2U);
  proxy.receive_from_client(kA, large, kStart + 10ms);
  EXPECT_EQ(proxy.in_flight(), 1U);
}

TEST(Proxy, EveryDatagramIsAccountedFor) {
  Proxy proxy(options("delay=uniform(5ms,35ms) loss=20% duplicate=10%", ""));
  std::uint64_t left = 0;
  for (int i = 0; i < 1000; ++i) {
    proxy.receive_from_client(kA, bytes("a"), kStart + i * 1ms);
    left += departures(proxy, kStart + i * 1ms).size();
  }
  left += departures(proxy, kStart + 10s).size();
  const ProxyCounters& n = proxy.counters(Direction::kUp);
  EXPECT_EQ(n.received, 1000U);
  EXPECT_EQ(n.received, n.lost + n.forwarded + n.refused);
  EXPECT_EQ(left, n.forwarded + n.duplicated);
  EXPECT_GT(n.duplicated, 50U);
  EXPECT_EQ(proxy.in_flight(), 0U);
}

TEST(Proxy, NamesTheDirectionOfAnImpossibleProfile) {
  ProxyOptions o = options("", "");
  o.down.loss = RandomLoss{2};
  try {
    const Proxy proxy(o);
    FAIL() << "was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "down: loss is 200%, expected a probability from 0% to 100%");
  }
}

}  // namespace
}  // namespace tendon::injector
