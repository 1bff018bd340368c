// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>

namespace tendon::hard::row_test {
namespace {

TEST(HardTable, HasALineForTheseTestsAndForNoOther) {
  std::set<std::string> lines;
  std::ifstream table(TENDON_HARD_TABLE);
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with("| `")) lines.insert(line.substr(3, line.find('`', 3) - 3));
  }
  std::set<std::string> tests;
  const auto& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const auto& suite = *all.GetTestSuite(i);
    if (std::string(suite.name()) == "HardTable") continue;
    for (int k = 0; k < suite.total_test_count(); ++k) {
      tests.insert(std::string(suite.name()) + "." + suite.GetTestInfo(k)->name());
    }
  }
  EXPECT_EQ(lines, tests);
}

}  // namespace
}  // namespace tendon::hard::row_test
