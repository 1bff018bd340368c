// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/compare.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace tendon::lab {
namespace {

TEST(Compare, TheGridHasAtLeastTwoThousandCellsForEachLaw) { EXPECT_GE(comparison_grid().size(), 2000U); }

TEST(Compare, AolPlusGivesOutNothingInASampleOfTheGrid) {
  const auto grid = comparison_grid();
  for (std::size_t i = 0; i < grid.size(); i += 61) {
    const Cell cell = compare_cell(grid[i], Law::kAolPlus, i);
    EXPECT_TRUE(cell.passive()) << i << ": " << cell.outcome.least_energy << " J";
  }
}

TEST(Compare, TheSameSeedGivesTheSameCell) {
  const Situation situation = comparison_grid()[100];
  const Outcome first = compare_cell(situation, Law::kAol, 7).outcome;
  const Outcome second = compare_cell(situation, Law::kAol, 7).outcome;
  EXPECT_EQ(first.force_error, second.force_error);
  EXPECT_EQ(first.least_energy, second.least_energy);
}

TEST(Compare, AnswersWhichOneToUse) {
  std::ostringstream out;
  compare({.every = 1153}, out);
  EXPECT_NE(out.str().find("Which one to use"), std::string::npos);
  EXPECT_NE(out.str().find("aol+ is passive in 2 of its 2 cells"), std::string::npos) << out.str();
}

}  // namespace
}  // namespace tendon::lab
