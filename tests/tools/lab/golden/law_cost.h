// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace tendon::lab {

/// Golden costs: the instructions in one step of every law, as a table that is committed. A law that got dearer shows
/// as a diff of it.
///
/// They depend on the compiler, its flags and Eigen, so the table says with which it was counted. With the same ones
/// they depend on nothing else: they are counted by callgrind, and no clock is asked.
struct CostTable {
  struct Row {
    std::string law;
    double instructions = 0;  ///< in one step
  };
  std::string built_with;  ///< compiler and version, flags, Eigen's version
  std::vector<Row> rows;
};

/// The share by which a figure may differ from the committed one.
inline constexpr double kCostTolerance = 0.02;

/// The compiler, its flags and the Eigen of this build: the first line of a table.
std::string built_with();

/// Counts every law of laws(), AOL+ with its default parts, on the motion of law_steps.h: the instructions of two
/// periods of the motion less those of one, divided by the steps of a period. `program` is law-cost.
///
/// Throws std::runtime_error when `program` cannot be run under valgrind.
CostTable count_law_costs(const std::filesystem::path& program);

/// CSV: "# counted with " and `built_with`; then `law,instructions_per_step` and the rows, to a tenth.
void write(std::ostream& out, const CostTable& table);

/// Throws std::runtime_error when the file cannot be read or is not such a table.
CostTable read_costs(const std::filesystem::path& file);

/// Why two tables cannot be compared: they were counted with something else. Empty when they can.
std::string why_not_comparable(const CostTable& was, const CostTable& is);

/// A line for each law that differs by more than kCostTolerance, or that is in one table only: law, was, is. Empty when
/// there is none.
std::string cost_differences(const CostTable& was, const CostTable& is);

}  // namespace tendon::lab
