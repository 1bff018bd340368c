// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/teleop_matrix.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace tendon::lab::teleop_matrix_test {
namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream text(line);
  for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
  return fields;
}

/// tests/golden/teleop_matrix.csv is the output of `tendon-lab teleop --matrix`.
TEST(TeleopMatrix, UnequalDevicesOverBurstsFeelWhatTheCommittedTableSays) {
  std::ifstream file(TENDON_GOLDEN "/teleop_matrix.csv");
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(line, "network,devices,counts,method,held,drift_mm,vibration_mm_s,energy_uj");
  int repeated = 0;
  for (const MatrixCase& of : matrix_cases()) {
    ASSERT_TRUE(std::getline(file, line));
    SCOPED_TRACE(line);
    const std::vector<std::string> was = fields_of(line);
    ASSERT_EQ(was.size(), 8);
    EXPECT_EQ(was[0], of.network);
    EXPECT_EQ(was[1], of.devices);
    EXPECT_EQ(was[2], of.counts ? "yes" : "no");
    EXPECT_EQ(was[3], to_string(of.method));
    if (of.network != "bursts" || of.devices != "falcon/phantom-premium") continue;
    ++repeated;
    const MatrixResult is = matrix_result(of, 1, Preset::kFeel);
    EXPECT_TRUE(is.engaged);
    if (of.method != CouplingMethod::kRate) {
      EXPECT_NEAR(is.held, std::stod(was[4]), 0.02);
      EXPECT_NEAR(is.drift * 1e3, std::stod(was[5]), 0.02);
    }
    EXPECT_NEAR(is.vibration * 1e3, std::stod(was[6]), 0.3);
    EXPECT_GE(is.energy, -1e-9);
  }
  EXPECT_EQ(repeated, 14);
  EXPECT_FALSE(std::getline(file, line)) << line;
}

}  // namespace
}  // namespace tendon::lab::teleop_matrix_test
