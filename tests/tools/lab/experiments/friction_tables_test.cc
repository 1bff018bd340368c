// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/friction_tables.h"

#include <gtest/gtest.h>

#include <vector>

namespace tendon::lab::friction_tables_test {
namespace {

TEST(FrictionTables, OnAShortTravelKellyIsOffTenfoldAndTheIntegralTrusted) {
  std::vector<FrictionTable> tables;
  for (const double damping : kTableDampings) tables.push_back(friction_table(damping));
  for (const FrictionTable& table : tables) {
    const PlaceEstimate& place = table.found.places.front();
    EXPECT_NEAR(place.integral.viscous, table.truth.viscous, 0.0015) << table.truth.viscous;
    EXPECT_LE(table.found.lower_bound.viscous, table.truth.viscous);
    EXPECT_LE(table.found.lower_bound.coulomb, table.truth.coulomb);
  }
  EXPECT_EQ(tables.front().found.trust, Trust::kBoth);
  EXPECT_EQ(tables.back().found.trust, Trust::kIntegral);
  EXPECT_GT(tables.back().found.places.front().kelly.viscous, 10 * tables.back().truth.viscous);
}

}  // namespace
}  // namespace tendon::lab::friction_tables_test
