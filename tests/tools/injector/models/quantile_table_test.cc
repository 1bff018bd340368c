// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/quantile_table.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "tests/tools/injector/models/exact_math.h"

namespace tendon::injector::quantile_table_test {
namespace {

constexpr std::uint64_t kLast = ~std::uint64_t{0};

/// Φ⁻¹ in units of 1e-6.
QuantileTable normal() {
  return tabulate(
      [](double p, double q) { return 1e6 * (p < q ? exact::normal_quantile(p) : -exact::normal_quantile(q)); },
      std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max());
}

TEST(QuantileTable, OneStraightPieceGivesEachOfItsValuesTheSameShareOfDraws) {
  const QuantileTable table({{0, 10, 3}});
  EXPECT_EQ(table(0), 10);
  EXPECT_EQ(table(kLast / 3 - 10), 10);
  EXPECT_EQ(table(kLast / 3 + 10), 11);
  EXPECT_EQ(table(kLast), 12);
  EXPECT_FALSE(table.constant());
  EXPECT_TRUE(QuantileTable({{0, 10, 1}}).constant());
}

TEST(QuantileTable, APieceOfOneDrawIsItsLeastValue) {
  const QuantileTable table({{0, 1, 1}, {5, -7, 1'000'000}, {6, 3, 1}});
  EXPECT_EQ(table(4), 1);
  EXPECT_EQ(table(5), -7);
  EXPECT_EQ(table(6), 3);
}

TEST(QuantileTable, ASmoothFunctionIsFollowedToOneInATrillionOnBothSides) {
  const QuantileTable table = normal();
  for (double p = 0.499; p > 1e-12; p *= 0.83) {
    const auto u = static_cast<std::uint64_t>(p * 0x1p64);
    const double z = exact::normal_quantile(p);
    // The error of one cell, 1/16 of the tail, is below (1/16)²/8 of the distance over which the tail falls by e.
    const double allowed = 5e-4 * p / (std::exp(-z * z / 2) / std::sqrt(2 * M_PI)) * 1e6 + 2;
    EXPECT_NEAR(static_cast<double>(table(u)), 1e6 * z, allowed) << p;
    EXPECT_NEAR(static_cast<double>(table(~u)), -1e6 * z, allowed) << p;
  }
  EXPECT_NEAR(static_cast<double>(table(0)), 1e6 * exact::normal_quantile(0x1p-40), 2);
  EXPECT_NEAR(static_cast<double>(table(kLast)), -1e6 * exact::normal_quantile(0x1p-40), 2);
}

RC_GTEST_PROP(QuantileTable, ALargerDrawNeverGivesLess, (std::uint64_t a, std::uint64_t z)) {
  static const QuantileTable kTable = normal();
  const auto shift = *rc::gen::inRange(0, 40);  // reaches the tails
  RC_ASSERT(kTable(std::min(a, z) >> shift) <= kTable(std::max(a, z) >> shift));
  RC_ASSERT(kTable(~(std::max(a, z) >> shift)) <= kTable(~(std::min(a, z) >> shift)));
}

RC_GTEST_PROP(QuantileTable, IsTheStraightLineOfWholeNumbersThatItSays, ()) {
  std::map<std::uint64_t, std::uint64_t> widths;
  widths[0] = *rc::gen::inRange<std::uint64_t>(1, std::uint64_t{1} << 37);
  for (int n = *rc::gen::inRange(0, 30); n > 0; --n) {
    const auto from = *rc::gen::arbitrary<std::uint64_t>() >> *rc::gen::inRange(0, 60);
    widths[from] = *rc::gen::inRange<std::uint64_t>(1, std::uint64_t{1} << 37);
  }
  std::vector<QuantileTable::Piece> pieces;
  for (const auto& [from, width] : widths) pieces.push_back({from, static_cast<std::int64_t>(from >> 20), width});
  const QuantileTable table(pieces);
  for (int n = 0; n < 50; ++n) {
    const std::uint64_t u = *rc::gen::arbitrary<std::uint64_t>() >> *rc::gen::inRange(0, 60);
    auto next = widths.upper_bound(u);
    const std::uint64_t end = next == widths.end() ? 0 : next->first;  // 0 stands for 2⁶⁴
    const auto& [from, width] = *std::prev(next);
    const long double length =
        end == 0 ? 0x1p64L - static_cast<long double>(from) : static_cast<long double>(end - from);
    const long double exact = static_cast<long double>(width) * static_cast<long double>(u - from) / length;
    const std::int64_t got = table(u) - static_cast<std::int64_t>(from >> 20);
    RC_ASSERT(got >= 0);
    RC_ASSERT(got < static_cast<std::int64_t>(width));
    RC_ASSERT(std::abs(static_cast<long double>(got) - exact) <= 1.0L);
  }
}

TEST(QuantileTable, HashTellsTablesApart) {
  EXPECT_EQ(normal().hash(), normal().hash());
  EXPECT_NE(QuantileTable({{0, 10, 3}}).hash(), QuantileTable({{0, 10, 4}}).hash());
  EXPECT_NE(QuantileTable({{0, 10, 3}}).hash(), QuantileTable({{0, 11, 3}}).hash());
  EXPECT_NE(QuantileTable({{0, 10, 1}, {7, 12, 1}}).hash(), QuantileTable({{0, 10, 1}, {8, 12, 1}}).hash());
}

}  // namespace
}  // namespace tendon::injector::quantile_table_test
