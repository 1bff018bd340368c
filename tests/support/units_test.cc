// SPDX-License-Identifier: Apache-2.0
#include "tests/support/units.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace tendon {
namespace {

std::string outcome(std::uint64_t unit) { return "unit " + std::to_string(unit * unit); }

UnitDigest digest_of(std::uint64_t first, std::uint64_t count) {
  UnitDigest digest;
  for (std::uint64_t i = 0; i < count; ++i) digest.add(first + i, outcome(first + i));
  return digest;
}

TEST(Units, AreTwoWholeNumbersWithAColonAndNothingElse) {
  EXPECT_EQ(parse_units("1:1000"), (Units{1, 1000}));
  EXPECT_EQ(parse_units("18446744073709551615:1"), (Units{18446744073709551615U, 1}));
  for (const char* bad : {"", "1", "1:", ":1", "1:0", "-1:5", "1:2:3", "1: 2", "a:b", "18446744073709551615:2"}) {
    EXPECT_THROW(parse_units(bad), std::invalid_argument) << bad;
  }
}

TEST(UnitDigest, IsTheSameHoweverTheUnitsAreCutAndInWhateverOrder) {
  const std::string whole = digest_of(1, 1000).text();
  for (const std::uint64_t cut : {1U, 37U, 500U, 999U}) {
    UnitDigest late_first = digest_of(1 + cut, 1000 - cut);
    late_first.add(digest_of(1, cut));
    EXPECT_EQ(late_first.text(), whole) << cut;
  }
}

TEST(UnitDigest, FindsTwoOutcomesThatHaveChangedPlacesAndAnyThatHasChanged) {
  UnitDigest swapped;
  swapped.add(1, outcome(2));
  swapped.add(2, outcome(1));
  EXPECT_NE(swapped.text(), digest_of(1, 2).text());
  EXPECT_NE(digest_of(2, 2).text(), digest_of(1, 2).text());
}

TEST(UnitDigest, CarriesFromItsLowerHalf) {
  const UnitDigest ones = UnitDigest::parse("0000000000000000ffffffffffffffff");
  UnitDigest sum = UnitDigest::parse("00000000000000000000000000000001");
  sum.add(ones);
  EXPECT_EQ(sum.text(), "00000000000000010000000000000000");
  EXPECT_THROW(UnitDigest::parse("12"), std::invalid_argument);
  EXPECT_THROW(UnitDigest::parse("0000000000000000fffffffffffffffg"), std::invalid_argument);
}

ShardEnd end_of(std::uint64_t first, std::uint64_t count) {
  return {.units = {first, count},
          .totals = {{"units", count}},
          .least = {{"energy_j", -1e-9 * static_cast<double>(first)}},
          .largest = {{"force_n", 0.1 + static_cast<double>(first)}},
          .digest = digest_of(first, count)};
}

TEST(ShardEnd, OfTwoShardsIsThatOfOneAndComesBackFromItsLine) {
  ShardEnd both = end_of(1, 10);
  both.add(end_of(11, 5));
  EXPECT_EQ(both.units, (Units{1, 15}));
  EXPECT_EQ(both.total("units"), 15U);
  EXPECT_EQ(both.least_of("energy_j"), -1e-9 * 11);
  EXPECT_EQ(both.largest[0].second, 11.1);
  EXPECT_EQ(both.digest.text(), digest_of(1, 15).text());
  EXPECT_EQ(ShardEnd::parse(both.line()).line(), both.line());
  EXPECT_THROW(both.total("worlds"), std::invalid_argument);
}

TEST(ShardEnd, RefusesAGapARepetitionAndOtherFigures) {
  ShardEnd end = end_of(1, 10);
  EXPECT_THROW(end.add(end_of(12, 5)), std::invalid_argument);
  EXPECT_THROW(end.add(end_of(10, 5)), std::invalid_argument);
  ShardEnd other = end_of(11, 5);
  other.totals[0].first = "worlds";
  EXPECT_THROW(end.add(other), std::invalid_argument);
  EXPECT_THROW(ShardEnd::parse("{\"kind\":\"broken\"}"), std::invalid_argument);
  EXPECT_THROW(ShardEnd::parse("{\"kind\":\"end\",\"first\":1"), std::invalid_argument);
}

}  // namespace
}  // namespace tendon
