// SPDX-License-Identifier: Apache-2.0
#include "tests/support/units.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::units_test {
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
  constexpr const char* kMoment = "0000000000000000";
  const UnitDigest ones = UnitDigest::parse("0000000000000000ffffffffffffffff", kMoment);
  UnitDigest sum = UnitDigest::parse("00000000000000000000000000000001", kMoment);
  sum.add(ones);
  EXPECT_EQ(sum.text(), "00000000000000010000000000000000");
  EXPECT_THROW(UnitDigest::parse("12", kMoment), std::invalid_argument);
  EXPECT_THROW(UnitDigest::parse("0000000000000000fffffffffffffffg", kMoment), std::invalid_argument);
  EXPECT_THROW(UnitDigest::parse(sum.text(), "12"), std::invalid_argument);
}

TEST(UnitDigest, TellsTheOneUnitThatDiffersAndNoneOfSeveral) {
  const auto with = [](const std::vector<std::uint64_t>& changed, std::uint64_t first) {
    UnitDigest digest;
    for (std::uint64_t unit = first; unit < first + 1000; ++unit) {
      digest.add(unit, outcome(unit) + (std::ranges::count(changed, unit) > 0 ? "!" : ""));
    }
    return digest;
  };
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 63}) {
    for (const std::uint64_t unit : {first, first + 1, first + 512, first + 999}) {
      EXPECT_EQ(with({unit}, first).differs_at(with({}, first), {first, 1000}), unit);
      EXPECT_EQ(with({}, first).differs_at(with({unit}, first), {first, 1000}), unit);
    }
    EXPECT_EQ(with({first, first + 1}, first).differs_at(with({}, first), {first, 1000}), std::nullopt);
    EXPECT_EQ(with({}, first).differs_at(with({}, first), {first, 1000}), std::nullopt);
  }
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

std::string shard(const Units& units) {
  std::ostringstream out;
  write_shard(
      units, 20,
      [](std::uint64_t unit, ShardEnd& end) {
        end.count("units", 1);
        end.lower("least", -static_cast<double>(unit));
        end.raise("most", static_cast<double>(unit));
        return "{\"unit\":" + std::to_string(unit) + ",\"part\":1}\n{\"unit\":" + std::to_string(unit) + "}\n";
      },
      out);
  return out.str();
}

std::string refusal_of(const std::string& lines) {
  std::istringstream in(lines);
  try {
    read_shards(in, 20);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(Shards, AreWrittenAndReadAgainUnitByUnit) {
  std::istringstream in(shard({0, 20}));
  const std::vector<std::string> units = read_shards(in, 20);
  ASSERT_EQ(units.size(), 20U);
  EXPECT_EQ(units[7], "{\"unit\":7,\"part\":1}\n{\"unit\":7}\n");
  const std::string some = shard({3, 4});
  const ShardEnd end = ShardEnd::parse(some.substr(some.rfind('\n', some.size() - 2) + 1));
  EXPECT_EQ(end.units, (Units{3, 4}));
  EXPECT_EQ(end.total("units"), 4U);
  EXPECT_EQ(end.least_of("least"), -6);
  EXPECT_EQ(end.largest[0].second, 6);
  EXPECT_THROW(shard({20, 1}), std::invalid_argument);
  EXPECT_THROW(shard({18, 3}), std::invalid_argument);
}

TEST(Shards, ThatLackAUnitHaveOneTwiceOrAnotherOutcomeAreRefused) {
  const std::string whole = shard({0, 20});
  EXPECT_EQ(refusal_of(whole), "none");
  EXPECT_EQ(refusal_of(""), "no end of a sweep");
  EXPECT_EQ(refusal_of(shard({0, 19})), "19 units: expected all, 0 to 19");
  EXPECT_EQ(refusal_of(shard({1, 19})), "line 1: expected unit 0 of 0 to 19, found 1");
  EXPECT_EQ(refusal_of(whole + whole), "line 42: expected nothing after the end");
  EXPECT_EQ(refusal_of("a line\n" + whole), "line 1: expected the line of a unit, {\"unit\":0,…}, or the end");
  std::string other = whole;
  other.replace(other.find("\"part\":1"), 8, "\"part\":2");
  EXPECT_EQ(refusal_of(other), "the end is not that of the units before it");
}

}  // namespace
}  // namespace tendon::units_test
