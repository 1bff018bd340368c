// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <string>

#include "core/base/reason.h"

// The specification for other languages must contain the same table of reasons as the code.

namespace tendon::wire_md_test {
namespace {

TEST(WireMd, ListsEveryReasonThatTheCodeHas) {
  std::map<int, std::string> listed;
  std::ifstream lines(TENDON_WIRE_MD);
  ASSERT_TRUE(lines.is_open()) << TENDON_WIRE_MD;
  const std::regex row(R"(\| bit (\d+) \| (\d+) ([^|]+) \| [^|]+ \|)");
  std::smatch cells;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, cells, row)) continue;
    const int bit = std::stoi(cells[1]);
    EXPECT_EQ(std::stoul(cells[2]), 1UL << bit) << line;
    listed[bit] = cells[3];
  }
  for (int bit = 0; bit < 32; ++bit) {
    EXPECT_EQ(listed[bit], to_string(Reasons::from_bits(1U << bit))) << "bit " << bit;
  }
}

}  // namespace
}  // namespace tendon::wire_md_test
