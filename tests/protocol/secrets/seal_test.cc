// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/seal.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "protocol/secrets/suites.h"
#include "tests/protocol/examples.h"

namespace tendon::seal_test {
namespace {

using examples::Bytes;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kOpened{seconds(100)};

class Seal : public ::testing::TestWithParam<Suite> {
 protected:
  explicit Seal(const Rekey& rekey = {}) : rekey_(rekey) {}
  void SetUp() override {
    if (GetParam() == Suite::kAesGcm && !crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  }

  Bytes sealed(LocalTime now, std::uint64_t number) {
    const Header header{.suite = GetParam(),
                        .epoch = sealer_.next_epoch(now),
                        .connection_id = examples::kConnection,
                        .packet_number = number};
    Bytes bytes = examples::data(number, {}, examples::state());
    const auto clear = encode_header(header);
    std::copy(clear.begin(), clear.end(), bytes.begin());
    const std::size_t size = bytes.size();
    bytes.resize(size + crypto::kTagSize);
    EXPECT_EQ(sealer_.seal(header, bytes, size), bytes.size());
    return bytes;
  }
  Opener::Verdict open(LocalTime now, const Bytes& datagram) {
    return opener_.open(now, *decode_header(datagram), datagram, body_);
  }

  Rekey rekey_;
  SealingKey key_{suites_of_this_machine().size() > 1 ? GetParam() : Suite::kNoise, Ratchet(1).next()};
  Sealer sealer_{key_, rekey_, kOpened};
  Opener opener_{key_, rekey_};
  std::array<std::byte, kMaxDatagram> body_{};
};

class SealWithRekeys : public Seal {
 protected:
  SealWithRekeys() : Seal({.datagrams = 10, .age = seconds(5), .overlap = seconds(2)}) {}
};

std::string name_of(const ::testing::TestParamInfo<Suite>& suite) {
  return "Suite" + std::to_string(static_cast<int>(suite.param));
}
INSTANTIATE_TEST_SUITE_P(Of, Seal, ::testing::Values(Suite::kNoise, Suite::kAesGcm), name_of);
INSTANTIATE_TEST_SUITE_P(Of, SealWithRekeys, ::testing::Values(Suite::kNoise, Suite::kAesGcm), name_of);

TEST_P(Seal, WhatWasSealedOpensAndIsNotReadableBefore) {
  const Bytes plain = examples::data(7, {}, examples::state());
  const Bytes datagram = sealed(kOpened, 7);
  EXPECT_EQ(datagram.size(), plain.size() + 16);
  EXPECT_FALSE(std::equal(plain.begin() + kHeaderSize, plain.end(), datagram.begin() + kHeaderSize));
  ASSERT_EQ(open(kOpened, datagram), Opener::Verdict::kOpened);
  EXPECT_TRUE(std::equal(plain.begin() + kHeaderSize, plain.end(), body_.begin()));
}

TEST_P(Seal, EveryBitOfADatagramCounts) {
  const Bytes good = sealed(kOpened, 7);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Bytes bad = good;
    bad[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    const auto header = decode_header(bad);
    if (!header) continue;  // not a valid datagram
    EXPECT_NE(opener_.open(kOpened, *header, bad, body_), Opener::Verdict::kOpened) << bit;
  }
  for (std::size_t size = kHeaderSize; size < good.size(); ++size) {
    EXPECT_EQ(open(kOpened, Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))),
              Opener::Verdict::kForged);
  }
}

TEST_P(SealWithRekeys, TheKeyIsRenewedAfterSoManyDatagrams) {
  for (std::uint64_t number = 0; number < 35; ++number) {
    const Bytes datagram = sealed(kOpened, number);
    EXPECT_EQ(decode_header(datagram)->epoch, number / 10);
    EXPECT_EQ(open(kOpened, datagram), Opener::Verdict::kOpened);
  }
}

TEST_P(SealWithRekeys, TheKeyIsRenewedAfterSoLong) {
  LocalTime now = kOpened;
  EXPECT_EQ(decode_header(sealed(now, 0))->epoch, 0);
  EXPECT_EQ(decode_header(sealed(now + milliseconds(4999), 1))->epoch, 0);
  EXPECT_EQ(decode_header(sealed(now + milliseconds(5000), 2))->epoch, 1);
}

TEST_P(SealWithRekeys, TheEpochWrapsAround) {
  for (std::uint64_t number = 0; number < 10 * 600; ++number) {
    const Bytes datagram = sealed(kOpened, number);
    ASSERT_EQ(decode_header(datagram)->epoch, number / 10 % 256);
    ASSERT_EQ(open(kOpened, datagram), Opener::Verdict::kOpened) << number;
  }
}

TEST_P(SealWithRekeys, TheKeyBeforeIsGoodForTwoSecondsMore) {
  const Bytes early = sealed(kOpened, 0);
  const Bytes late = sealed(kOpened, 1);
  for (std::uint64_t number = 2; number < 10; ++number) sealed(kOpened, number);
  EXPECT_EQ(open(kOpened, sealed(kOpened, 10)), Opener::Verdict::kOpened);
  EXPECT_EQ(open(kOpened + milliseconds(1999), early), Opener::Verdict::kOpened);
  EXPECT_EQ(open(kOpened + milliseconds(2000), late), Opener::Verdict::kOldKey);
}

TEST_P(SealWithRekeys, AForgedDatagramOfTheNextEpochMovesNobodyOn) {
  const Bytes good = sealed(kOpened, 0);
  Bytes forged = good;
  forged[2] = std::byte{1};
  EXPECT_EQ(open(kOpened, forged), Opener::Verdict::kForged);
  EXPECT_EQ(open(kOpened + seconds(60), good), Opener::Verdict::kOpened);
}

TEST_P(Seal, BytesOfAnyLengthOpenAsTheyWereAndOnlyUnderTheirNumber) {
  for (std::size_t size = 0; size <= kMaxDatagram - kHeaderSize - crypto::kTagSize; size += size < 80 ? 1 : 61) {
    Bytes plain(size);
    for (std::size_t i = 0; i < size; ++i) plain[i] = static_cast<std::byte>(i * 7 + size);
    Bytes apart(size + crypto::kTagSize);
    Bytes in_place = plain;
    in_place.resize(apart.size());
    const std::uint64_t number = (std::uint64_t{1} << 40) + size;  // not a palindrome
    key_.seal(number, {}, plain, apart);
    key_.seal(number, {}, std::span(in_place).first(size), in_place);
    EXPECT_EQ(in_place, apart) << size;
    Bytes opened(size);
    EXPECT_TRUE(key_.open(number, {}, apart, opened)) << size;
    EXPECT_EQ(opened, plain) << size;
    EXPECT_FALSE(key_.open(number + 1, {}, apart, opened)) << size;
  }
}

TEST_P(SealWithRekeys, TwoEpochsAheadIsNotOpened) {
  for (std::uint64_t number = 0; number < 20; ++number) sealed(kOpened, number);
  const Bytes ahead = sealed(kOpened, 20);
  ASSERT_EQ(decode_header(ahead)->epoch, 2);
  EXPECT_EQ(open(kOpened, ahead), Opener::Verdict::kOldKey);
}

}  // namespace
}  // namespace tendon::seal_test
