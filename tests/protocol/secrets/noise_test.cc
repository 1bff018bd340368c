// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/noise.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/protocol/examples.h"

// vectors_test.cc contains the known answer of cacophony.

namespace tendon::noise_test {
namespace {

using examples::Bytes;

class Noise : public ::testing::Test {
 protected:
  static Bytes text(std::string_view text) {
    const auto raw = std::as_bytes(std::span(text));
    return {raw.begin(), raw.end()};
  }

  Ratchet random_{1};
  Key psk_ = random_.next();
  Bytes prologue_ = text("prologue");
  NoiseInitiator a_{psk_, random_.next(), prologue_, text("hello")};
};

TEST_F(Noise, BothEndsEndWithTheSameKeysAndEachOthersWords) {
  const auto z = NoiseResponder::read(psk_, prologue_, a_.message());
  ASSERT_TRUE(z.has_value());
  EXPECT_EQ(z->payload(), text("hello"));
  const auto reply = z->reply(random_.next(), text("welcome"));
  const auto answer = a_.read(reply->message);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->payload, text("welcome"));
  EXPECT_EQ(answer->split.initiator_to_responder.bytes(), reply->split.initiator_to_responder.bytes());
  EXPECT_EQ(answer->split.responder_to_initiator.bytes(), reply->split.responder_to_initiator.bytes());
  EXPECT_NE(answer->split.initiator_to_responder.bytes(), answer->split.responder_to_initiator.bytes());
}

TEST_F(Noise, TheKeysOfSuite2AreBoundToTheWholeHandshake) {
  const auto z = NoiseResponder::read(psk_, prologue_, a_.message());
  const Key ephemeral = random_.next();
  // The result of Split() does not depend on the second payload, but the keys of suite 2 do.
  const NoiseSplit one = z->reply(ephemeral, text("welcome"))->split;
  const NoiseSplit other = z->reply(ephemeral, text("welcome to suite 2"))->split;
  ASSERT_EQ(one.initiator_to_responder.bytes(), other.initiator_to_responder.bytes());
  EXPECT_NE(split_of_suite_2(one).initiator_to_responder.bytes(),
            split_of_suite_2(other).initiator_to_responder.bytes());
  EXPECT_NE(split_of_suite_2(one).responder_to_initiator.bytes(),
            split_of_suite_2(other).responder_to_initiator.bytes());
  const std::set<Bytes32> all = {one.initiator_to_responder.bytes(), one.responder_to_initiator.bytes(),
                                 split_of_suite_2(one).initiator_to_responder.bytes(),
                                 split_of_suite_2(one).responder_to_initiator.bytes()};
  EXPECT_EQ(all.size(), 4U);
}

TEST_F(Noise, EveryBitOfBothMessagesCounts) {
  const auto z = NoiseResponder::read(psk_, prologue_, a_.message());
  const Bytes reply = z->reply(random_.next(), text("welcome"))->message;
  // X25519 masks the last bit of a public key, but the handshake hash covers it.
  for (std::size_t bit = 0; bit < 8 * a_.message().size(); ++bit) {
    Bytes bad = a_.message();
    bad[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_FALSE(NoiseResponder::read(psk_, prologue_, bad).has_value()) << bit;
  }
  for (std::size_t bit = 0; bit < 8 * reply.size(); ++bit) {
    Bytes bad = reply;
    bad[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_FALSE(a_.read(bad).has_value()) << bit;
  }
  EXPECT_TRUE(a_.read(reply).has_value());  // the true answer must still be accepted
}

TEST_F(Noise, ACutMessageDoesNotOpen) {
  const auto z = NoiseResponder::read(psk_, prologue_, a_.message());
  const Bytes reply = z->reply(random_.next(), text("welcome"))->message;
  for (std::size_t size = 0; size < a_.message().size(); ++size) {
    EXPECT_FALSE(NoiseResponder::read(psk_, prologue_, std::span(a_.message()).first(size)).has_value());
  }
  for (std::size_t size = 0; size < reply.size(); ++size) {
    EXPECT_FALSE(a_.read(std::span(reply).first(size)).has_value());
  }
}

TEST_F(Noise, AnotherKeyOrAnotherPrologueDoesNotOpen) {
  EXPECT_FALSE(NoiseResponder::read(random_.next(), prologue_, a_.message()).has_value());
  EXPECT_FALSE(NoiseResponder::read(psk_, text("Prologue"), a_.message()).has_value());
}

TEST_F(Noise, OneWhoKnowsTheKeyButNotTheEphemeralOnesCannotReadTheAnswer) {
  const auto z = NoiseResponder::read(psk_, prologue_, a_.message());
  const Bytes reply = z->reply(random_.next(), text("welcome"))->message;
  // The attacker knows the key and has recorded everything, but its ephemeral key is different.
  const NoiseInitiator thief(psk_, random_.next(), prologue_, text("hello"));
  EXPECT_FALSE(thief.read(reply).has_value());
}

}  // namespace
}  // namespace tendon::noise_test
