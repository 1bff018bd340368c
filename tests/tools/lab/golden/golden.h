// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace tendon::lab {

/// Results of every law as a committed file, so that a change of a law is visible as a diff. Law and situation are the
/// key of a row. Columns are quantities in SI units. Numbers have the shortest form that parses to the same value, so
/// equal text means equal bits.
struct GoldenTable {
  struct Row {
    std::string law;
    std::string situation;
    std::vector<std::string> figures;  ///< one for each of `columns`
  };
  std::vector<std::string> columns;
  std::vector<Row> rows;
};

/// Every law in every 209th situation of comparison_grid(), which covers all values of all axes, and in the experiments
/// of the paper, with the prescribed motion and with the free hand. Bit-identical on all x86-64 processors and C
/// libraries, because only correctly rounded IEEE 754 operations of libm are used (core/base/portable_math.h).
GoldenTable golden_laws();

/// CSV: `law,situation,` and the columns. No cell contains a comma or quote.
void write(std::ostream& out, const GoldenTable& table);

/// Throws std::runtime_error if the file cannot be read or is not a golden table.
GoldenTable read_golden(const std::filesystem::path& file);

struct GoldenDifference {
  std::string law;
  std::string situation;
  std::string figure;
  std::string was;  ///< empty: added
  std::string is;   ///< empty: removed
};
std::vector<GoldenDifference> differences(const GoldenTable& was, const GoldenTable& is);

/// Returns one line for each difference with the law, the situation, the figure and both values.
std::string to_text(const std::vector<GoldenDifference>& differences);

/// Compares the current results with FOLDER/laws.csv or rewrites it. With `cost`: FOLDER/cost.csv (law_cost.h), counted
/// with the program `law_cost`.
struct GoldenOptions {
  std::filesystem::path folder = "tests/golden";
  bool write = false;
  bool cost = false;
  std::filesystem::path law_cost{};
};

/// True if nothing differs. Throws std::runtime_error if the file cannot be read or written, or its costs were counted
/// with another compiler.
bool golden(const GoldenOptions& options, std::ostream& out);

}  // namespace tendon::lab
