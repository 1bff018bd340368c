// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/crypto.h"

#include <gtest/gtest.h>

#include <set>

#include "protocol/secrets/blake2b.h"
#include "tests/protocol/examples.h"

// vectors_test.cc contains the known answers.

namespace tendon::crypto_test {
namespace {

TEST(Ratchet, GivesTheSameSecretsForTheSameSeedAndNoneTwice) {
  Ratchet a(1);
  Ratchet z(1);
  Ratchet other(2);
  std::set<Bytes32> seen;
  for (int i = 0; i < 1000; ++i) {
    const Bytes32 secret = a.next().bytes();
    EXPECT_EQ(secret, z.next().bytes());
    EXPECT_TRUE(seen.insert(secret).second);
    EXPECT_TRUE(seen.insert(other.next().bytes()).second);
  }
}

TEST(Ratchet, HoldsNothingOfWhatItHasGiven) {
  Ratchet ratchet(1);
  const Bytes32 given = ratchet.next().bytes();
  const auto memory = std::as_bytes(std::span(&ratchet, 1));
  EXPECT_EQ(std::search(memory.begin(), memory.end(), given.begin(), given.end()), memory.end());
}

TEST(Crypto, APointOfLowOrderMakesNoSecret) {
  Key shared;
  Bytes32 point{};
  EXPECT_FALSE(crypto::x25519(Ratchet(1).next(), point, shared));
  point[0] = std::byte{1};
  EXPECT_FALSE(crypto::x25519(Ratchet(1).next(), point, shared));
}

TEST(Crypto, ARenewedKeyIsAnother) {
  const Key key = Ratchet(1).next();
  EXPECT_NE(crypto::renewed(key).bytes(), key.bytes());
  EXPECT_NE(crypto::renewed(crypto::renewed(key)).bytes(), crypto::renewed(key).bytes());
}

TEST(Crypto, Blake2bGivesTheKnownDigests) {  // computed with hashlib of Python
  const auto abc = std::as_bytes(std::span("abc", 3));
  EXPECT_EQ(examples::hex(crypto::blake2b_128(abc)), "cf4ab791c62b8d2b2109c90275287816");
  EXPECT_EQ(examples::hex(crypto::blake2b_256(abc)),
            "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319");
}

}  // namespace
}  // namespace tendon::crypto_test
