// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/draws.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <set>

namespace tendon::injector::draws_test {
namespace {

using Words = std::array<std::uint32_t, 4>;

// Random123-1.14.0, tests/kat_vectors: philox4x32 10.
TEST(Philox, GivesTheKnownAnswersOfItsAuthors) {
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Draws, AreThePhiloxWordsOfSeedLinkDirectionPurposeAndIndex) {
  const Draws draws(0x0123456789abcdef, 9, Direction::kDown);
  const Words words = philox4x32({0x00000005, 0x00000007, 2 * 2 + 1, 9}, {0x89abcdef, 0x01234567});
  EXPECT_EQ(draws(Purpose::kLoss, 0x0000000700000005), words[0] + (std::uint64_t{words[1]} << 32));
}

TEST(Draws, OfAnotherSeedLinkDirectionPurposeOrIndexAreOthers) {
  const std::set<std::uint64_t> all = {Draws(1, 0, Direction::kUp)(Purpose::kDelay, 0),
                                       Draws(2, 0, Direction::kUp)(Purpose::kDelay, 0),
                                       Draws(1, 1, Direction::kUp)(Purpose::kDelay, 0),
                                       Draws(1, 0, Direction::kDown)(Purpose::kDelay, 0),
                                       Draws(1, 0, Direction::kUp)(Purpose::kLoss, 0),
                                       Draws(1, 0, Direction::kUp)(Purpose::kDelay, 1),
                                       Draws(1, 0, Direction::kUp)(Purpose::kDelay, std::uint64_t{1} << 32)};
  EXPECT_EQ(all.size(), 7U);
}

TEST(Chance, OfZeroNeverHappensAndOfOneAlways) {
  for (const std::uint64_t draw : {std::uint64_t{0}, ~std::uint64_t{0}}) {
    EXPECT_FALSE(Chance(0).happens(draw));
    EXPECT_TRUE(Chance(1).happens(draw));
  }
  EXPECT_FALSE(Chance(0).possible());
  EXPECT_TRUE(Chance(0x1p-64).happens(0));
  EXPECT_FALSE(Chance(0x1p-64).happens(1));
  EXPECT_TRUE(Chance(0.5).happens((std::uint64_t{1} << 63) - 1));
  EXPECT_FALSE(Chance(0.5).happens(std::uint64_t{1} << 63));
}

TEST(OneOf, DividesTheDrawsEvenly) {
  EXPECT_EQ(one_of(3, 0), 0U);
  EXPECT_EQ(one_of(3, 0x5555555555555555), 0U);
  EXPECT_EQ(one_of(3, 0x5555555555555556), 1U);
  EXPECT_EQ(one_of(3, ~std::uint64_t{0}), 2U);
}

}  // namespace
}  // namespace tendon::injector::draws_test
