// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/json_line.h"

namespace tendon::lab {

/// The CSV of all commands (RFC 4180): a line with # and the command that repeats it, the names of the columns, and a
/// line per row. Numbers have at most six significant digits, because the last ones can differ between processors. true
/// is "yes", false is "no". An empty field is not known.
class CsvTable {
 public:
  /// Without a `command`, there is no line with #.
  explicit CsvTable(std::string command = {}) : command_(std::move(command)) {}

  /// A new key is added as the last column. Throws std::logic_error if a value is a list or an object.
  void add(const JsonLine& row);
  std::string str() const;
  /// Replaces the file in one step. Throws std::runtime_error if it is not a table of these programs, or cannot be
  /// written.
  void write(const std::filesystem::path& file) const;

 private:
  std::string command_;
  std::vector<std::string> columns_{};
  std::vector<std::pair<std::string, std::size_t>> rows_{};  ///< text and number of fields
};

}  // namespace tendon::lab
