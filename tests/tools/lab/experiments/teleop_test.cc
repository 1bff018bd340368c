// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/teleop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

namespace tendon::lab::teleop_test {
namespace {

/// tests/golden/teleop.csv contains the results of three hands from seed 1 at 20 and 200 ms.
TEST(Teleop, EachMethodIsFeltAsTheCommittedTableSays) {
  constexpr int kRoundTrips[] = {20, 200};
  const auto rows = teleop_rows(3, 1, kRoundTrips);
  std::ifstream file(TENDON_GOLDEN "/teleop.csv");
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(line, "method,round_trip_ms,felt_first,felt_second");
  for (const TeleopRow& row : rows) {
    std::ostringstream is;
    is << to_string(row.method) << ',' << row.round_trip_ms << ',' << row.first << ',' << row.second;
    ASSERT_TRUE(std::getline(file, line)) << is.str();
    std::istringstream was(line);
    std::string method;
    std::string number;
    std::getline(was, method, ',');
    EXPECT_EQ(method, to_string(row.method)) << is.str();
    for (const double value : {double(row.round_trip_ms), row.first, row.second}) {
      ASSERT_TRUE(std::getline(was, number, ',')) << is.str();
      EXPECT_NEAR(value, std::stod(number), 0.02 * std::abs(value)) << is.str() << ", was " << line;
    }
    EXPECT_GE(row.pair, -1e-9) << is.str();
    EXPECT_LT(row.buzz, 2e-3) << is.str();
  }
  EXPECT_FALSE(std::getline(file, line)) << line;
}

}  // namespace
}  // namespace tendon::lab::teleop_test
