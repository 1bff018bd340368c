// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/force_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <vector>

#include "protocol/limits.h"
#include "tests/clients/cpp/a_and_z.h"

namespace tendon::force_client_session_test {
namespace {

using a_and_z::answer;
using a_and_z::kFineWeather;
using a_and_z::Server;
using a_and_z::World;
using std::chrono::milliseconds;
using Phase = ForceClient::Phase;
constexpr Duration kSecond = std::chrono::seconds(1);

TEST(ForceClient, AsksForTheStateRateOnceInEachSession) {
  World world(14, {.loss = 0.3});
  world.connect({.state_hz = 250}, answer);
  world.run(5 * kSecond);
  ASSERT_EQ(world.z->requests.size(), static_cast<std::size_t>(world.z->welcomes));
  EXPECT_EQ(std::get<SetStateRate>(world.z->requests.front()).hz, 250U);
}

TEST(ForceClient, ReportsARefusalAndAsksAgainEverMoreSeldom) {
  World world(15, kFineWeather);
  world.z->refusal = Refused{Code::kBusy, "the device has a controller", 1, 1};
  world.connect({}, answer);
  ASSERT_TRUE(world.run_until(Phase::kRefused, kSecond));
  EXPECT_EQ(world.a->stats().code, Code::kBusy);
  EXPECT_EQ(world.a->stats().reason, "the device has a controller");

  world.run(60 * kSecond);
  const std::vector<LocalTime>& attempts = world.z->attempts;
  EXPECT_LE(attempts.size(), 35U) << "one in 2 s, and five on the way there";
  EXPECT_GE(attempts.size(), 30U);
  for (std::size_t i = 2; i < attempts.size(); ++i) {
    EXPECT_GE(attempts[i] - attempts[i - 1], attempts[i - 1] - attempts[i - 2]) << "attempt " << i;
  }
  EXPECT_EQ(world.a->stats().attempts, attempts.size()) << "each attempt has a new client random, which Z counts";
  EXPECT_EQ(world.a->stats().sessions, 0U);

  world.z->refusal.reset();
  EXPECT_TRUE(world.run_until(Phase::kOpen, 3 * kSecond)) << "let in as soon as the place is free";
}

TEST(ForceClient, ALeaseWonAndLostBeforeEitherIsHeardIsLost) {
  for (const Code once_more : {Code::kBusy, Code::kOk}) {
    World world(21, kFineWeather);
    world.connect({}, answer);
    ASSERT_TRUE(world.run_until(Phase::kOpen, kSecond));
    world.z->lease_answers = {Code::kOk, once_more};
    world.z->snatches = 1;
    ASSERT_TRUE(world.a->take_lease());
    world.run(kSecond);
    EXPECT_EQ(world.a->holds(), once_more == Code::kOk);
    EXPECT_EQ(world.a->stats().lease_lost_to, once_more == Code::kOk ? "" : "another");
    EXPECT_EQ(world.z->requests.size(), 2U) << "it has asked again, once";
  }
}

TEST(ForceClient, ConnectsAgainWhenTheServerHasRestarted) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed);
    world.connect({.rate_hz = 100}, answer);
    world.run(3 * kSecond);
    ASSERT_EQ(world.a->phase(), Phase::kOpen) << "seed " << seed;
    world.restart_server();
    // This includes 2 s of silence, 100 ms of back-off, and a handshake.
    world.run(4 * kSecond);
    EXPECT_EQ(world.a->phase(), Phase::kOpen) << "seed " << seed;
    EXPECT_EQ(world.a->stats().sessions, 2U) << "seed " << seed;
    ASSERT_FALSE(world.z->forces.empty()) << "seed " << seed;
    EXPECT_LE(world.z->forces.front().second.sequence, 5U) << "forces are numbered from 1 again";
  }
}

TEST(ForceClient, FindsAServerThatStartsLate) {
  World world(17);
  world.kill_server();
  world.connect({}, answer);
  ASSERT_TRUE(world.run_until(Phase::kUnanswered, 3 * kSecond));
  EXPECT_EQ(world.a->stats().code, Code::kTimedOut);
  world.run(60 * kSecond);
  EXPECT_LE(world.a_port.sent, 500) << "20 Hellos in every 4 s";
  world.restart_server();
  EXPECT_TRUE(world.run_until(Phase::kOpen, 3 * kSecond));
}

TEST(ForceClient, ConnectsAgainSoonAfterTheServerSaidByeHoweverOften) {
  World world(18, kFineWeather);
  world.connect({.rate_hz = 100}, answer);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(world.run_until(Phase::kOpen, milliseconds(200))) << "after Bye number " << i;
    world.run(kSecond);
    world.z->say_bye(world.now, Code::kShutdown);
    ASSERT_TRUE(world.run_until(Phase::kLost, milliseconds(20)));
    EXPECT_EQ(world.a->stats().code, Code::kShutdown);
    EXPECT_EQ(world.a->stats().reason, "Z closes");
    EXPECT_GT(world.a->stats().link.datagrams_received, 0U) << "the last session's figures stay readable";
  }
}

TEST(ForceClient, SaysByeWhenItStops) {
  World world(19, kFineWeather);
  world.connect({.rate_hz = 100}, answer);
  world.run(kSecond);
  world.a->stop(world.now);
  EXPECT_EQ(world.a->phase(), Phase::kStopped);
  world.run(milliseconds(10));
  EXPECT_EQ(world.z->closed, Code::kOk) << "at once, not by a timeout";
  const int sent = world.a_port.sent;
  EXPECT_EQ(world.a->turn(world.now + 10 * kSecond), LocalTime::max());
  EXPECT_EQ(world.a_port.sent, sent);
}

TEST(ForceClient, WhatThePhysicsThrowsComesOutOfTheTurnAfterABye) {
  World world(20, kFineWeather);
  world.connect({.rate_hz = 100}, [&](const DeviceState& hand) -> Touch {
    if (hand.tick > 500) throw std::runtime_error("the mesh has burst");
    return answer(hand);
  });
  EXPECT_THROW(world.run(kSecond), std::runtime_error);
  EXPECT_EQ(world.a->phase(), Phase::kStopped);
  world.run(milliseconds(10));
  EXPECT_EQ(world.z->closed, Code::kOk);
}

TEST(ForceClient, ThePhysicsMayStopItAndItsForceIsThenNotSent) {
  World world(21, kFineWeather);
  std::uint64_t calls = 0;
  world.connect({.rate_hz = 100}, [&](const DeviceState& hand) {
    if (++calls == 50) world.a->stop(world.now);
    return answer(hand);
  });
  world.run(kSecond);
  EXPECT_EQ(world.a->phase(), Phase::kStopped);
  EXPECT_EQ(world.z->closed, Code::kOk);
  EXPECT_EQ(calls, 50U);
  EXPECT_EQ(world.a->stats().forces, 49U);
}

TEST(ForceClient, HearsNobodyButItsServer) {
  World world(22, kFineWeather);
  world.connect({.rate_hz = 100}, answer);
  world.run(kSecond);
  const LinkStats before = world.a->stats().link;
  const Address stranger = parse_address("203.0.113.9:47100");
  const std::vector<std::byte> noise(100, std::byte{0x54});
  for (int i = 0; i < 10; ++i) world.network().send(world.now, stranger, a_and_z::a_address, noise);
  world.run(milliseconds(100));
  EXPECT_EQ(world.a->stats().foreign, 10U);
  EXPECT_EQ(world.a->stats().link.malformed, before.malformed);
}

TEST(ForceClient, CountsATooLargeDatagramWithAGoodBeginningAsMalformed) {
  World world(23, kFineWeather);
  world.connect({.rate_hz = 100}, answer);
  world.run(kSecond);
  // A Data header for connection 1 with a new packet number and tx_time_ns = 0. Unknown fields follow.
  std::vector<unsigned char> bytes = {0x54, 0x13, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0};
  bytes.insert(bytes.end(), {0x09, 0, 0, 0, 0, 0, 0, 0, 0, 0x78, 0x80, 0x00});
  const auto pad_to = [&](std::size_t size) {
    while (bytes.size() < size) bytes.insert(bytes.end(), {0x78, 0x00});
    return std::as_bytes(std::span(bytes));
  };
  const LinkStats before = world.a->stats().link;
  world.a->turn(world.now);
  world.network().send(world.now, a_and_z::z_address, a_and_z::a_address, pad_to(kMaxDatagram));
  ++bytes[8];
  world.network().send(world.now, a_and_z::z_address, a_and_z::a_address, pad_to(5000));
  world.run(milliseconds(6));
  const LinkStats after = world.a->stats().link;
  EXPECT_EQ(after.malformed, before.malformed + 1);
  EXPECT_GT(after.lost, before.lost + 60'000) << "the first was good: its number leaves a gap";
}

TEST(ForceClient, AFloodDoesNotKeepItFromSending) {
  World world(24, kFineWeather);
  world.connect({.rate_hz = 100}, [](const DeviceState&, const LinkStats&) {});
  world.run(kSecond);
  const std::vector<std::byte> noise(100, std::byte{0x00});
  for (int i = 0; i < 1000; ++i) world.network().send(world.now, a_and_z::z_address, a_and_z::a_address, noise);
  world.now += milliseconds(60);
  const int sent = world.a_port.sent;
  EXPECT_EQ(world.a->turn(world.now), world.now) << "there is more to read";
  EXPECT_EQ(world.a_port.sent, sent + 1) << "the keep-alive";
}

}  // namespace
}  // namespace tendon::force_client_session_test
