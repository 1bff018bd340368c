// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace tendon::lab {

/// Golden numbers: what every law does, as a table that is committed. A change of a law shows as a diff of it.
///
/// Columns are figures in SI units, named in the header. A row is a law in a situation, its key is those two cells.
/// Numbers are as short as they can be read back exactly, so that equal text means equal bits.
struct GoldenTable {
  struct Row {
    std::string law;
    std::string situation;
    std::vector<std::string> figures;  ///< one for each of `columns`
  };
  std::vector<std::string> columns;
  std::vector<Row> rows;
};

/// Every law in twelve situations, which are each 209th of comparison_grid() and in which every value of every axis
/// occurs; and the experiments of the paper, on the prescribed motion and with the free hand. Takes some seconds.
///
/// The same bytes on every x86-64 processor, with every C library: nothing on the way to it calls libm for more than
/// what IEEE 754 rounds correctly (core/base/portable_math.h).
GoldenTable golden_laws();

/// CSV: `law,situation,` and the columns. No cell has a comma or a quote.
void write(std::ostream& out, const GoldenTable& table);

/// Throws std::runtime_error when the file cannot be read or is not such a table.
GoldenTable read_golden(const std::filesystem::path& file);

/// What differs between two tables, bit for bit.
struct GoldenDifference {
  std::string law;
  std::string situation;
  std::string figure;
  std::string was;  ///< empty: it was not there
  std::string is;   ///< empty: it is gone
};
std::vector<GoldenDifference> differences(const GoldenTable& was, const GoldenTable& is);

/// One line each under a heading: law, situation, figure, was, is.
std::string to_text(const std::vector<GoldenDifference>& differences);

/// `tendon-lab golden`: compares what is with FOLDER/laws.csv, or writes that anew. With `cost`: with FOLDER/cost.csv
/// (law_cost.h), which it counts with `law_cost`, the program.
struct GoldenOptions {
  std::filesystem::path folder = "tests/golden";
  bool write = false;
  bool cost = false;
  std::filesystem::path law_cost{};
};

/// Returns whether nothing differs. Throws std::runtime_error when the file cannot be read or written, or when another
/// compiler counted the costs in it.
bool golden(const GoldenOptions& options, std::ostream& out);

}  // namespace tendon::lab
