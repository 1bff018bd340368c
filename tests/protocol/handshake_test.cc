// SPDX-License-Identifier: Apache-2.0
#include "protocol/handshake.h"

#include <gtest/gtest.h>

#include "tests/protocol/examples.h"

namespace tendon::handshake_test {
namespace {

using examples::Bytes;
using std::chrono::milliseconds;
using std::chrono::seconds;

using Buffer = std::array<std::byte, kMaxDatagram>;

Address address(std::uint8_t host, std::uint16_t port) {
  Address a;
  a.ip[10] = a.ip[11] = 0xFF;
  a.ip[12] = 127;
  a.ip[15] = host;
  a.port = port;
  return a;
}

/// A is a client, and Z is the server side.
class Handshake : public ::testing::Test {
 protected:
  static ClientHandshake::Config client_config() {
    ClientHandshake::Config config;
    config.hello = examples::hello();
    config.random = examples::random();
    return config;
  }
  static ServerHandshake::Config door_config() {
    ServerHandshake::Config config;
    config.secret.fill(std::byte{0x5A});
    return config;
  }

  Bytes hello_of(ClientHandshake& client) {
    const std::size_t size = client.next_datagram(now_, buffer_);
    return {buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size)};
  }
  ServerHandshake::Reply knock(const Bytes& datagram) { return z_->receive(now_, from_, datagram, answer_); }
  Bytes answer(std::size_t size) const {
    return {answer_.begin(), answer_.begin() + static_cast<std::ptrdiff_t>(size)};
  }

  Bytes hello_with_cookie() {
    ClientHandshake client(client_config(), now_);
    const auto retry = knock(hello_of(client));
    client.receive(now_, answer(retry.size));
    return hello_of(client);
  }

  LocalTime now_{seconds(1000)};
  Address from_ = address(1, 4000);
  Buffer buffer_{};
  Buffer answer_{};
  std::optional<ServerHandshake> z_{std::in_place, door_config()};
  ClientHandshake a_{client_config(), now_};
};

TEST_F(Handshake, HelloRetryHelloWelcomeOpensIt) {
  const Bytes first = hello_of(a_);
  EXPECT_EQ(first.size(), kMaxDatagram);
  const auto retry = knock(first);
  EXPECT_FALSE(retry.client.has_value());  // A has not yet returned the cookie
  ASSERT_GT(retry.size, 0U);

  a_.receive(now_, answer(retry.size));
  const Bytes second = hello_of(a_);
  ASSERT_EQ(second.size(), kMaxDatagram);
  const auto reply = knock(second);
  EXPECT_EQ(reply.size, 0U);
  ASSERT_TRUE(reply.client.has_value());
  EXPECT_EQ(reply.client->hello.name, "wall");
  EXPECT_EQ(reply.client->hello.role, Role::kController);
  EXPECT_EQ(reply.client->version, 1U);

  const std::size_t size = z_->welcome(*reply.client, 77, examples::welcome(), answer_).size;
  EXPECT_LT(size, second.size());
  a_.receive(now_, answer(size));
  ASSERT_TRUE(a_.outcome().has_value());
  const auto& accepted = std::get<ClientHandshake::Accepted>(*a_.outcome());
  EXPECT_EQ(accepted.connection_id, 77U);
  EXPECT_EQ(accepted.welcome.device_name, "simulated");
  EXPECT_EQ(hello_of(a_).size(), 0U);
  EXPECT_EQ(a_.next_tick(), LocalTime::max());
}

TEST_F(Handshake, TheRetryIsFarSmallerThanTheHello) { EXPECT_EQ(knock(hello_of(a_)).size, 48U); }

TEST_F(Handshake, ARefusalSaysWhy) {
  a_.receive(now_, examples::answer_datagram(0, examples::refused()));
  ASSERT_TRUE(a_.outcome().has_value());
  const auto& refused = std::get<Refused>(*a_.outcome());
  EXPECT_EQ(refused.code, Code::kBusy);
  EXPECT_EQ(refused.detail, "one controller");
}

TEST_F(Handshake, EveryBitOfTheCookieCounts) {
  const Bytes good = hello_with_cookie();
  ASSERT_TRUE(knock(good).client.has_value());
  for (std::size_t bit = 0; bit < 128; ++bit) {
    Bytes bad = good;
    bad[kHeaderSize + 16 + bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    const auto reply = knock(bad);
    EXPECT_FALSE(reply.client.has_value()) << bit;
    EXPECT_EQ(reply.size, 48U) << bit;
  }
}

TEST_F(Handshake, ACookieIsForOneAddressPortAndAttemptAndAllDoors) {
  const Bytes good = hello_with_cookie();
  EXPECT_FALSE(z_->receive(now_, address(2, 4000), good, answer_).client.has_value());
  EXPECT_FALSE(z_->receive(now_, address(1, 4001), good, answer_).client.has_value());
  Bytes other_attempt = good;
  other_attempt[kHeaderSize] ^= std::byte{1};  // part of the client's random
  EXPECT_FALSE(knock(other_attempt).client.has_value());
  ServerHandshake::Config config = door_config();
  config.number = 1;
  EXPECT_TRUE(ServerHandshake(config).receive(now_, from_, good, answer_).client.has_value());
  config.secret[31] = std::byte{0};
  EXPECT_FALSE(ServerHandshake(config).receive(now_, from_, good, answer_).client.has_value()) << "another server";
}

TEST_F(Handshake, ACookieLivesOneKeyLifetimeAndNoLongerThanTwo) {
  for (const auto start : {seconds(-10), seconds(960), seconds(1000), seconds(1079)}) {
    now_ = LocalTime{start};
    const Bytes hello = hello_with_cookie();
    now_ = LocalTime{start + seconds(120)};
    EXPECT_TRUE(knock(hello).client.has_value()) << start.count();
    now_ = LocalTime{start + seconds(240)};
    EXPECT_FALSE(knock(hello).client.has_value()) << start.count();
  }
}

TEST_F(Handshake, ACookieThatExpiredIsReplacedByANewRetry) {
  ClientHandshake late(client_config(), now_);
  const auto retry = knock(hello_of(late));
  late.receive(now_, answer(retry.size));
  now_ += seconds(500);
  const auto again = knock(hello_of(late));
  ASSERT_EQ(again.size, 48U);
  late.receive(now_, answer(again.size));
  now_ = late.next_tick();
  late.tick(now_);
  EXPECT_TRUE(knock(hello_of(late)).client.has_value());
}

TEST_F(Handshake, AHelloSentAgainIsTheSameClient) {
  const Bytes hello = hello_with_cookie();
  const auto first = knock(hello);
  now_ += milliseconds(100);
  const auto second = knock(hello);
  ASSERT_TRUE(first.client && second.client);
  EXPECT_EQ(first.client->random, second.client->random);
}

TEST_F(Handshake, TheHighestCommonVersionIsChosen) {
  struct Case {
    std::uint32_t client_min, client_max, server_min, server_max, common;
  };
  for (const Case& c : {Case{1, 1, 1, 1, 1}, Case{1, 3, 1, 2, 2}, Case{2, 9, 1, 5, 5}, Case{1, 2, 2, 7, 2},
                        Case{2, 3, 1, 1, 0}, Case{1, 1, 2, 3, 0}}) {
    ServerHandshake::Config door = door_config();
    door.version_min = c.server_min;
    door.version_max = c.server_max;
    z_.emplace(door);
    ClientHandshake::Config config = client_config();
    config.hello.version_min = c.client_min;
    config.hello.version_max = c.client_max;
    ClientHandshake client(config, now_);
    client.receive(now_, answer(knock(hello_of(client)).size));
    const auto reply = knock(hello_of(client));
    ASSERT_TRUE(reply.client.has_value());
    EXPECT_EQ(reply.client->version, c.common);
  }
}

TEST_F(Handshake, AWelcomeToAVersionThatWasNotOfferedIsIgnored) {
  Welcome welcome = examples::welcome();
  welcome.version = 2;
  a_.receive(now_, examples::answer_datagram(1, welcome));
  EXPECT_FALSE(a_.outcome().has_value());
}

TEST_F(Handshake, TheConnectionIdOfAnAnswerIsNotChecked) {
  a_.receive(now_, examples::answer_datagram(0, examples::welcome()));
  ASSERT_TRUE(a_.outcome() && std::holds_alternative<ClientHandshake::Accepted>(*a_.outcome()));
  EXPECT_EQ(std::get<ClientHandshake::Accepted>(*a_.outcome()).connection_id, 0U);
  ClientHandshake refused(client_config(), now_);
  refused.receive(now_, examples::answer_datagram(7, examples::refused()));
  EXPECT_TRUE(refused.outcome() && std::holds_alternative<Refused>(*refused.outcome()));
}

TEST_F(Handshake, WhatAnswersAnotherAttemptIsIgnored) {
  const auto other = examples::sixteen(0x10);
  for (const Answer& said : {Answer(examples::welcome()), Answer(examples::refused())}) {
    a_.receive(now_, examples::encoded(AnswerDatagram{.connection_id = 1, .random = other, .body = write_body(said)}));
  }
  EXPECT_FALSE(a_.outcome().has_value());

  hello_of(a_);
  a_.receive(now_, examples::encoded(RetryDatagram{.random = other, .cookie = examples::cookie()}));
  EXPECT_EQ(hello_of(a_).size(), 0U);
}

TEST_F(Handshake, AHelloIsSentAgainUntilItIsAnswered) {
  int sent = 0;
  for (int i = 0; i < 10; ++i) {
    now_ = a_.next_tick();
    a_.tick(now_);
    sent += hello_of(a_).empty() ? 0 : 1;
    EXPECT_EQ(hello_of(a_).size(), 0U);
  }
  EXPECT_EQ(sent, 10);
  EXPECT_EQ(now_, LocalTime{seconds(1000) + 9 * milliseconds(100)});
}

TEST_F(Handshake, AStreamOfRetriesDoesNotMakeAStreamOfHellos) {
  hello_of(a_);
  const Bytes retry = examples::encoded(RetryDatagram{.random = examples::random(), .cookie = examples::cookie()});
  int sent = 0;
  for (int i = 0; i < 1000; ++i) {
    a_.receive(now_, retry);
    sent += hello_of(a_).empty() ? 0 : 1;
  }
  EXPECT_EQ(sent, 1);
}

TEST_F(Handshake, TheDoorIsSilentForAnythingThatIsNoHello) {
  const Bytes hello = hello_with_cookie();
  std::uint64_t expected = 0;
  const auto silent = [&](const Bytes& datagram, const std::string& what) {
    const auto reply = knock(datagram);
    EXPECT_EQ(reply.size, 0U) << what;
    EXPECT_FALSE(reply.client.has_value()) << what;
    EXPECT_EQ(z_->stats().malformed, ++expected) << what;
  };
  for (std::size_t size = 0; size < hello.size(); ++size) {
    silent(Bytes(hello.begin(), hello.begin() + static_cast<std::ptrdiff_t>(size)), "cut to " + std::to_string(size));
  }
  Bytes longer = hello;
  longer.push_back(std::byte{0});
  silent(longer, "one byte too long");
  for (const auto& other : examples::datagrams()) {
    if (other.name.rfind("hello", 0) != 0) silent(other.bytes, other.name);
  }
}

TEST_F(Handshake, NoReplyIsEverLongerThanTheDatagramItAnswers) {
  const Bytes hello = hello_with_cookie();
  for (std::size_t at = 0; at < hello.size(); ++at) {
    for (unsigned flip = 1; flip < 256; flip <<= 1U) {
      Bytes bad = hello;
      bad[at] ^= static_cast<std::byte>(flip);
      EXPECT_LE(knock(bad).size, bad.size());
    }
  }
}

TEST_F(Handshake, ARefusalFitsADatagramHoweverMuchItHasToSay) {
  const auto client = knock(hello_with_cookie()).client;
  ASSERT_TRUE(client.has_value());
  Refused refused = examples::refused();
  refused.detail.assign(5000, 'x');
  EXPECT_LT(z_->refuse(*client, refused, answer_).size, kMaxDatagram);
}

TEST_F(Handshake, ImpossibleSettingsAreRefusedAtOnce) {
  ServerHandshake::Config config = door_config();
  config.key_lifetime = Duration{};
  EXPECT_THROW(ServerHandshake{config}, std::invalid_argument);
  config = door_config();
  config.version_min = 2;
  EXPECT_THROW(ServerHandshake{config}, std::invalid_argument);
}

}  // namespace
}  // namespace tendon::handshake_test
