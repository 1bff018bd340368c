// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/golden.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include "core/control/limiter.h"

namespace tendon::lab {
namespace {

TEST(Golden, EveryLawDoesWhatTheCommittedTableSays) {
  const auto found = differences(read_golden(TENDON_GOLDEN "/laws.csv"), golden_laws());
  EXPECT_TRUE(found.empty()) << to_text(found)
                             << "If the change is meant: tendon-lab golden --write, and commit the table with it.";
}

TEST(Golden, EveryLawAndEveryExperimentIsInTheTable) {
  const GoldenTable table = read_golden(TENDON_GOLDEN "/laws.csv");
  EXPECT_GE(table.rows.size(), 200U);
  for (const LawInfo& law : laws()) {
    const auto rows = std::ranges::count(table.rows, law.name, &GoldenTable::Row::law);
    EXPECT_GE(rows, 12) << law.name;
  }
}

TEST(Golden, ATableThatIsWrittenIsReadBackTheSame) {
  const GoldenTable table = read_golden(TENDON_GOLDEN "/laws.csv");
  std::ostringstream text;
  write(text, table);
  std::ifstream file(TENDON_GOLDEN "/laws.csv");
  std::ostringstream committed;
  committed << file.rdbuf();
  EXPECT_EQ(text.str(), committed.str());
}

TEST(Golden, ADifferenceNamesLawSituationFigureAndBothValues) {
  const GoldenTable was{{"a_n", "gone_j"}, {{"aol", "here", {"1", "2"}}, {"aol", "there", {"3", "4"}}}};
  const GoldenTable is{{"a_n", "new_m"}, {{"aol", "here", {"1.5", "7"}}, {"aol+", "here", {"5", "6"}}}};
  EXPECT_EQ(to_text(differences(was, is)),
            "law   situation  figure  was  is\n"
            "aol   here       a_n     1    1.5\n"
            "aol   here       new_m        7\n"
            "aol+  here       a_n          5\n"
            "aol+  here       new_m        6\n"
            "aol   here       gone_j  2    \n"
            "aol   there      a_n     3    \n"
            "aol   there      gone_j  4    \n");
  EXPECT_TRUE(differences(was, was).empty());
}

}  // namespace
}  // namespace tendon::lab
