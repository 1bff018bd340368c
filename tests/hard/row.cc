// SPDX-License-Identifier: Apache-2.0
#include "tests/hard/row.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace tendon::hard {
namespace {

bool table_has(const std::string& name, const Row& row) {
  std::ifstream table(TENDON_HARD_TABLE);
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with("| `" + name + "` | " + row.hard + " | " + row.oracle + " |")) return true;
  }
  return false;
}

}  // namespace

void report(const Row& row) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const std::string name = std::string(test->test_suite_name()) + "." + test->name();
  EXPECT_TRUE(table_has(name, row)) << "README.md has not this row of " << name << "; tests/hard/table writes it";
  const char* folder = std::getenv("TENDON_HARD_ROWS");  // NOLINT(concurrency-mt-unsafe): nothing here sets it
  if (folder == nullptr) return;
  nlohmann::ordered_json json{{"name", name}, {"hard", row.hard}, {"oracle", row.oracle}, {"result", row.result}};
  json["margin"] = row.margin ? nlohmann::ordered_json(*row.margin) : nlohmann::ordered_json();
  json["without"] = row.without;
  std::filesystem::create_directories(folder);
  std::ofstream(std::filesystem::path(folder) / (name + ".json")) << json << '\n';
}

}  // namespace tendon::hard
