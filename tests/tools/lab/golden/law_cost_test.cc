// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/law_cost.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/control/limiter.h"
#include "core/control/preset.h"
#include "tests/support/instruction_test.h"

namespace tendon::lab::law_cost_test {
namespace {

constexpr const char* kTable = TENDON_GOLDEN "/cost.csv";

using LawCost = testing::InstructionTest;

TEST_F(LawCost, AStepOfEveryLawCostsWhatTheCommittedTableSays) {
  const CostTable was = read_costs(kTable);
  const std::string why = why_not_comparable(was, {.built_with = built_with(), .rows = {}});
  if (!why.empty()) GTEST_SKIP() << "skipped: " << why;
  const std::string found = cost_differences(was, count_law_costs(TENDON_LAW_COST));
  EXPECT_TRUE(found.empty())
      << found << "If the change is meant: tendon-lab golden --cost --write, and commit the table with it.";
}

TEST(LawCostTable, HasEveryLawAndPresetInOrderAndTheField) {
  const CostTable table = read_costs(kTable);
  ASSERT_EQ(table.rows.size(), laws().size() + presets().size() + 1);
  for (std::size_t i = 0; i < laws().size(); ++i) EXPECT_EQ(table.rows[i].law, laws()[i].name);
  for (std::size_t i = 0; i < presets().size(); ++i) {
    EXPECT_EQ(table.rows[laws().size() + i].law, presets()[i].name);
  }
  EXPECT_EQ(table.rows.back().law, "field");
}

TEST(LawCostTable, IsReadBackAsItWasWritten) {
  std::ostringstream text;
  write(text, read_costs(kTable));
  std::ostringstream committed;
  committed << std::ifstream(kTable).rdbuf();
  EXPECT_EQ(text.str(), committed.str());
}

TEST(LawCostTable, ADifferenceOfMoreThanTwoPercentNamesTheLawAndBothFigures) {
  const CostTable was{"gcc", {{"aol", 100}, {"aol+", 200}, {"clamp", 50}, {"gone", 9}}};
  const CostTable is{"gcc", {{"aol", 101.9}, {"aol+", 210}, {"clamp", 48.5}, {"new", 7}}};
  EXPECT_EQ(cost_differences(was, is),
            "aol+: committed 200.0 instructions per step, 210.0 now, +5.0 %\n"
            "clamp: committed 50.0 instructions per step, 48.5 now, -3.0 %\n"
            "new: not in the table; now 7.0 instructions per step\n"
            "gone: in the table, but the law does not exist\n");
  EXPECT_EQ(cost_differences(was, was), "");
}

TEST(LawCostTable, IsNotComparedWithThatOfAnotherCompiler) {
  EXPECT_EQ(why_not_comparable({"GNU 12", {}}, {"GNU 12", {}}), "");
  EXPECT_EQ(why_not_comparable({"GNU 12", {}}, {"GNU 13", {}}),
            "the committed costs are for GNU 12; this build uses GNU 13");
}

}  // namespace
}  // namespace tendon::lab::law_cost_test
