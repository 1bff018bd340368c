// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon {

/// Reads a table of numbers from a text file, one row at a time:
/// - UTF-8 byte order marks, blank lines, lines that start with #, blanks around cells, and CR before LF are ignored.
/// - The separator is the first of semicolon, tab and comma that is in the first line, except in quotes. If the first
///   line only contains numbers and simple names, it can also be a blank.
/// - Cells can be quoted with double quotes. Inside, "" is a single quote. Line breaks are not allowed.
/// - Numbers can have a decimal point. If the separator is not a comma, they can have a decimal comma instead.
///   Thousands separators are not allowed. In quotes or in a tab-separated file, `1,012` could mean 1.012 or 1012. This
///   is an error unless an earlier number shows that the comma is a decimal comma.
/// - The first line is a header if none of its cells is a number. All rows must have the same number of cells.
///
/// All errors are reported as std::runtime_error with the message "NAME:LINE: what was expected, what was found". After
/// an error in a row, the next row can be read. It does not read past the current line, as pipes require.
class TableReader {
 public:
  struct Options {
    /// If there is only one column, a blank line after the first row is a row with an empty cell.
    bool blank_lines_are_cells = false;
    bool trailing_comments = false;  ///< at the end of a line, starting with a blank and a #
  };

  static constexpr std::size_t kMaxLine = 65'536;  ///< bytes; protects against binary files

  /// Reads the first nonblank line. `name` is used in error messages.
  TableReader(std::istream& from, std::string name, const Options& options);
  TableReader(std::istream& from, std::string name) : TableReader(from, std::move(name), Options()) {}
  TableReader(TableReader&&) = default;

  /// The index of a column, and the factor that converts its numbers to the requested unit.
  struct Column {
    std::size_t index = 0;
    double multiply = 1;
    double divide = 1;
  };

  const std::vector<std::string>& names() const noexcept { return names_; }  ///< empty if there is no header
  const std::string& first_line() const noexcept { return first_line_; }     ///< or the first row if there is no header
  char separator() const noexcept { return separator_; }
  std::size_t width() const noexcept { return width_; }
  std::size_t line() const noexcept { return line_number_; }

  /// Returns the column with this name, for example "x_mm", or one with the same name and a compatible unit, whose
  /// numbers are converted. The unit can be specified as "x_m", "X [m]", "x (m)" or "x/m". The names "time" and
  /// "timestamp" are equivalent to "t". Returns nothing if there is no such column. Throws an error if there are two.
  std::optional<Column> find(std::string_view name) const;
  Column column(std::string_view name) const;
  /// Returns the column with this index. Numbers in another compatible unit are converted to `unit`.
  Column column(std::size_t index, std::string_view unit) const;
  /// Throws an error if there is no column with exactly this name, or if there are two.
  std::size_t index_of(std::string_view name) const;

  bool next_row();

  std::string_view text(std::size_t column) const { return cells_.at(column).text; }
  /// Returns nothing if the cell is empty. Throws an error if it is not a finite number.
  std::optional<double> number(const Column& column);
  double needed_number(const Column& column);

  /// Throws an error with the current line. Control characters are replaced.
  [[noreturn]] void fail(std::string sentence) const;

 private:
  struct Cell {
    std::string_view text;
    bool quoted = false;
  };

  std::optional<std::string_view> next_line();
  void read_first_row();
  void split(std::string_view line);
  std::string_view uncommented(std::string_view line) const;
  [[noreturn]] void refuse_number(std::size_t column) const;
  double value_of(std::size_t column);

  std::istream& from_;
  std::string name_;
  Options options_;
  std::vector<char> buffer_ = std::vector<char>(kMaxLine + 1);
  std::size_t line_number_ = 0;
  char separator_ = ',';
  std::vector<std::string> names_;
  std::string first_line_;
  std::size_t width_ = 0;
  std::vector<Cell> cells_;  ///< the current row; points to buffer_ and unquoted_
  std::string unquoted_;
  bool first_row_waits_ = false;
  std::size_t decimal_point_line_ = 0;  ///< line of the first decimal point, or 0
  std::size_t decimal_comma_line_ = 0;
};

}  // namespace tendon
