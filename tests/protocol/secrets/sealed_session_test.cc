// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/world.h"

// Tests a session in suite 1: authentication, rejected datagrams, and the end of the session.

namespace tendon::sealed_session_test {
namespace {

using examples::Bytes;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kOpened{seconds(100)};

SessionKeys some_keys() {
  Ratchet random(1);
  const Key up = random.next();
  return {.send = up, .receive = random.next()};
}
SessionKeys turned(const SessionKeys& keys) { return {.send = keys.receive, .receive = keys.send}; }

class SealedSession : public ::testing::Test {
 protected:
  explicit SealedSession(const Session::Config& config = {.connection_id = examples::kConnection})
      : a_(config, some_keys(), kOpened), z_(config, turned(some_keys()), kOpened) {}

  static std::optional<Bytes> next(Session& from, LocalTime now) {
    std::array<std::byte, kMaxDatagram> buffer;
    const std::size_t size = from.next_datagram(now, buffer);
    if (size == 0) return {};
    return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
  }
  Bytes force(std::uint64_t sequence) {
    ForceCommand command = examples::force();
    command.sequence = sequence;
    a_.send(command);
    return *next(a_, now_);
  }

  LocalTime now_ = kOpened;
  Session a_;
  Session z_;
};

TEST_F(SealedSession, AForceArrivesAsItWasSent) {
  EXPECT_TRUE(z_.receive(now_, force(7)));
  const auto event = z_.next_event();
  EXPECT_EQ(std::get<Session::ForceArrived>(*event).command.sequence, 7U);
}

TEST_F(SealedSession, OnlyTheNewestAuthenticDatagramTellsWhereThePeerIs) {
  const Bytes first = force(1);
  const Bytes second = force(2);
  Bytes forged = force(3);
  forged.back() ^= std::byte{1};
  EXPECT_TRUE(z_.receive(now_, second));
  EXPECT_FALSE(z_.receive(now_, first));   // late: the peer may have moved since
  EXPECT_FALSE(z_.receive(now_, second));  // replayed
  EXPECT_FALSE(z_.receive(now_, forged));
  EXPECT_EQ(z_.stats().datagrams_received, 2U);
  EXPECT_EQ(z_.stats().duplicated, 1U);
  EXPECT_EQ(z_.stats().forged, 1U);
}

TEST_F(SealedSession, AForgedNumberDoesNotShutOutTheTrueOne) {
  const Bytes good = force(1);
  Bytes forged = good;
  forged[kHeaderSize] ^= std::byte{1};
  EXPECT_FALSE(z_.receive(now_, forged));
  EXPECT_TRUE(z_.receive(now_, good));
}

TEST_F(SealedSession, WhatIsForgedIsNoSignOfLife) {
  ASSERT_TRUE(z_.receive(now_, force(1)));
  for (std::uint64_t i = 2; i < 100; ++i) {
    now_ += milliseconds(30);
    Bytes forged = force(i);
    forged.back() ^= std::byte{1};
    z_.receive(now_, forged);
    z_.tick(now_);
  }
  EXPECT_FALSE(z_.open());
}

TEST_F(SealedSession, AMessageReflectedToItsSenderDoesNotOpen) {
  EXPECT_FALSE(a_.receive(now_, force(1)));
  EXPECT_EQ(a_.stats().forged, 1U);
}

TEST_F(SealedSession, FullDatagramsStayWithin1200Bytes) {
  for (int i = 0; i < 16; ++i) a_.request(SetStateRate{static_cast<std::uint32_t>(i)});
  for (std::uint32_t id = 1; id <= 16; ++id) {
    ASSERT_TRUE(z_.receive(now_, force(id)));
  }
  while (const auto request = z_.next_event()) {
    if (const auto* arrived = std::get_if<Session::RequestArrived>(&*request)) {
      z_.answer(arrived->id, Code::kOk, std::string(128, 'x'));
    }
  }
  std::size_t largest = 0;
  while (const auto datagram = next(z_, now_)) {
    largest = std::max(largest, datagram->size());
    EXPECT_TRUE(a_.receive(now_, *datagram));
  }
  EXPECT_LE(largest, kMaxDatagram);
  EXPECT_GT(largest, kMaxDatagram - 200);
}

class ShortSealedSession : public SealedSession {
 protected:
  ShortSealedSession()
      : SealedSession({.connection_id = examples::kConnection, .life = seconds(60), .max_datagrams = 1000}) {}
};

TEST_F(ShortSealedSession, EndsAtItsAgeWithAByeAndSaysSo) {
  while (a_.open() && now_ < kOpened + seconds(120)) {
    now_ += milliseconds(100);
    while (const auto datagram = next(z_, now_)) a_.receive(now_, *datagram);
    while (const auto datagram = next(a_, now_)) z_.receive(now_, *datagram);
    a_.tick(now_);
  }
  EXPECT_EQ(now_, kOpened + seconds(60));
  const auto event = a_.next_event();
  ASSERT_TRUE(event && std::holds_alternative<Session::Closed>(*event));
  EXPECT_EQ(std::get<Session::Closed>(*event).code, Code::kExpired);
  int byes = 0;
  while (const auto datagram = next(a_, now_)) {
    ++byes;
    z_.receive(now_, *datagram);
  }
  EXPECT_EQ(byes, 3);
  EXPECT_EQ(std::get<Session::Closed>(*z_.next_event()).code, Code::kExpired);
}

TEST_F(SealedSession, EndsWhenSomebodyHasGuessedAtTagsForTooLong) {
  Session::Config config{.connection_id = examples::kConnection};
  config.max_forged = 3;
  Session z(config, turned(some_keys()), kOpened);
  Bytes forged = force(1);
  forged.back() ^= std::byte{1};
  for (int guesses = 0; guesses < 3; ++guesses) {
    z.tick(now_);
    EXPECT_TRUE(z.open()) << guesses;
    z.receive(now_, forged);
  }
  z.tick(now_);
  EXPECT_FALSE(z.open());
  EXPECT_EQ(std::get<Session::Closed>(*z.next_event()).code, Code::kExpired);
}

TEST_F(SealedSession, AKeyIsNotToSealMoreThanItsCipherBears) {
  Session::Config config{.connection_id = examples::kConnection};
  config.rekey.datagrams = limits::kMaxDatagramsOfKey;
  EXPECT_NO_THROW(Session(config, some_keys(), kOpened));
  ++config.rekey.datagrams;
  EXPECT_THROW(Session(config, some_keys(), kOpened), std::invalid_argument);
}

TEST_F(ShortSealedSession, EndsBeforeAPacketNumberCouldComeTwice) {
  std::uint64_t sent = 0;
  for (std::uint64_t i = 1; a_.open() && i < 5000; ++i) {
    force(i);
    ++sent;
    a_.tick(now_);
  }
  EXPECT_EQ(sent, 1000U);
}

TEST(SealedWorld, ManyRekeysOverABadNetworkLoseNothingThatWasPromised) {
  Session::Config config{.connection_id = examples::kConnection};
  config.rekey = {.datagrams = 200, .age = seconds(7), .overlap = seconds(2)};
  const Weather bad{.delay = milliseconds(20), .jitter = milliseconds(60), .loss = 0.3, .duplicate = 0.1};
  World world(bad, bad, 5, config, some_keys());
  std::uint32_t asked = 0;
  std::uint32_t arrived = 0;
  std::uint32_t answered = 0;
  std::uint64_t sequence = 0;
  world.on_z = [&](const Session::Event& event) {
    if (const auto* request = std::get_if<Session::RequestArrived>(&event)) {
      EXPECT_EQ(request->id, ++arrived);
      world.z.answer(request->id, Code::kOk, {});
    }
  };
  world.on_a = [&](const Session::Event& event) {
    if (std::holds_alternative<Session::RequestAnswered>(event)) ++answered;
  };
  world.wake = world.now;
  world.run(seconds(300), [&] {
    if (world.now < world.wake) return;
    world.wake = world.now + milliseconds(10);
    ForceCommand command = examples::force();
    command.sequence = ++sequence;
    world.a.send(command);
    if (sequence % 100 == 0 && world.a.request(Rearm{})) ++asked;
  });
  EXPECT_TRUE(world.a.open() && world.z.open());
  EXPECT_GT(asked, 100U);
  EXPECT_GE(arrived + 2, asked);
  EXPECT_GE(answered + 3, asked);
  for (const LinkStats& s : {world.a.stats(), world.z.stats()}) {
    EXPECT_EQ(s.forged, 0U);
    EXPECT_EQ(s.old_key, 0U);
    EXPECT_EQ(s.malformed, 0U);
  }
}

}  // namespace
}  // namespace tendon::sealed_session_test
