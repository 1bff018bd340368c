// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace tendon::lab {

/// Instructions per step of every law and of a field (field::Renderer), counted by callgrind, as a committed table. They depend only on the compiler,
/// its flags and Eigen, which the table names.
struct CostTable {
  struct Row {
    std::string law;
    double instructions = 0;  ///< per step
  };
  std::string built_with;  ///< compiler and version, flags, Eigen's version
  std::vector<Row> rows;
};

inline constexpr double kCostTolerance = 0.02;

/// Returns compiler, flags and Eigen version of this build: the first line of a table.
std::string built_with();

/// AOL+ with its default parts, on the motion of law_steps.h, and a proxy on bricks: instructions of two periods minus
/// those of one, divided by the steps per period. `program` is law-cost. Throws std::runtime_error if it cannot be run under
/// valgrind.
CostTable count_law_costs(const std::filesystem::path& program);

/// CSV: "# counted with " and `built_with`, then `law,instructions_per_step` and the rows, to a tenth.
void write(std::ostream& out, const CostTable& table);

/// Throws std::runtime_error if the file cannot be read or is not a cost table.
CostTable read_costs(const std::filesystem::path& file);

/// The difference of the builds, or empty.
std::string why_not_comparable(const CostTable& was, const CostTable& is);

/// Returns a line (law, was, is) for each law that differs by more than kCostTolerance or is missing in one table.
std::string cost_differences(const CostTable& was, const CostTable& is);

}  // namespace tendon::lab
