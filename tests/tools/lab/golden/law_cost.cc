// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/law_cost.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <ostream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "server/machine/regular_file.h"
#include "tests/support/callgrind.h"
#include "tests/tools/lab/experiments/law_steps.h"

namespace tendon::lab {
namespace {

constexpr std::string_view kCountedWith = "# counted with ";
constexpr std::string_view kHeading = "law,instructions_per_step";

std::string tenths(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

const CostTable::Row* find(const CostTable& table, const std::string& law) {
  const auto row = std::ranges::find(table.rows, law, &CostTable::Row::law);
  return row == table.rows.end() ? nullptr : &*row;
}

}  // namespace

std::string built_with() {
  const auto number = [](int part) { return std::to_string(part); };
  return TENDON_COMPILER ", Eigen " + number(EIGEN_WORLD_VERSION) + "." + number(EIGEN_MAJOR_VERSION) + "." +
         number(EIGEN_MINOR_VERSION);
}

CostTable count_law_costs(const std::filesystem::path& program) {
  CostTable table{.built_with = built_with(), .rows = {}};
  for (const auto& [option, function] : {std::pair{"", "step_law"}, std::pair{"--field", "step_field"}}) {
    for (const testing::Counted& row : testing::count_instructions(program.string(), option, function)) {
      table.rows.push_back({row.line, row.instructions / static_cast<double>(LawSteps::kPeriod)});
    }
  }
  return table;
}

void write(std::ostream& out, const CostTable& table) {
  out << kCountedWith << table.built_with << "\n" << kHeading << "\n";
  for (const CostTable::Row& row : table.rows) out << row.law << "," << tenths(row.instructions) << "\n";
}

CostTable read_costs(const std::filesystem::path& file) {
  std::ifstream in = open_regular_file(file, "table of costs");
  const auto refuse = [&](std::size_t number, const std::string& expected) {
    throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": expected " + expected);
  };
  std::string line;
  if (!std::getline(in, line) || !line.starts_with(kCountedWith)) refuse(1, "\"" + std::string(kCountedWith) + "…\"");
  CostTable table{.built_with = line.substr(kCountedWith.size()), .rows = {}};
  if (!std::getline(in, line) || line != kHeading) refuse(2, std::string(kHeading));
  for (std::size_t number = 3; std::getline(in, line); ++number) {
    const auto comma = line.find(',');
    double instructions = 0;
    int end = 0;
    if (comma == std::string::npos || std::sscanf(line.c_str() + comma + 1, "%lf%n", &instructions, &end) != 1 ||
        comma + 1 + static_cast<std::size_t>(end) != line.size() || !(instructions > 0)) {
      refuse(number, "a law, a comma and its instructions");
    }
    table.rows.push_back({line.substr(0, comma), instructions});
  }
  return table;
}

std::string why_not_comparable(const CostTable& was, const CostTable& is) {
  if (was.built_with == is.built_with) return {};
  return "the committed costs are for " + was.built_with + "; this build uses " + is.built_with;
}

std::string cost_differences(const CostTable& was, const CostTable& is) {
  std::string text;
  for (const CostTable::Row& row : is.rows) {
    const CostTable::Row* const before = find(was, row.law);
    if (before == nullptr) {
      text += row.law + ": not in the table; now " + tenths(row.instructions) + " instructions per step\n";
    } else if (std::abs(row.instructions - before->instructions) > kCostTolerance * before->instructions) {
      std::array<char, 32> share{};
      std::snprintf(share.data(), share.size(), "%+.1f %%", 100 * (row.instructions / before->instructions - 1));
      text += row.law + ": committed " + tenths(before->instructions) + " instructions per step, " +
              tenths(row.instructions) + " now, " + share.data() + "\n";
    }
  }
  for (const CostTable::Row& row : was.rows) {
    if (find(is, row.law) == nullptr) text += row.law + ": in the table, but the law does not exist\n";
  }
  return text;
}

}  // namespace tendon::lab
