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

/// Reads a table of numbers from a text file, one row at a time. It accepts the formats that loggers and spreadsheets
/// write:
///
/// - It skips a UTF-8 byte order mark, blank lines, lines that begin with #, and blanks around cells. Lines may end with
///   CR LF.
/// - The separator is a semicolon, a tab or a comma. The reader takes the first of these that the first line contains
///   outside quotes. If the first line contains only numbers and simple names, the separator may be a blank.
/// - A cell may be quoted with double quotes. Inside quotes, "" stands for one quote. A line break cannot be quoted.
/// - A number may have a decimal point, or a decimal comma if the comma is not the separator. A file must not mix the
///   two, and must not separate thousands. In a tab-separated file, or in quotes, `1,012` can mean 1.012 or 1012. The
///   reader refuses it unless an earlier number shows that the comma is a decimal comma.
/// - The first line is a header if none of its cells is a number. All other rows must have as many cells as the first.
///
/// All errors are std::runtime_error with the text "NAME:LINE: what was expected, what was found". After an error in one
/// row, the caller can read the next row. The reader never reads past the end of the current line, so it works on a
/// pipe.
class TableReader {
 public:
  struct Options {
    /// If the table has one column, a blank line after the first row counts as a row with an empty cell.
    bool blank_lines_are_cells = false;
    /// A comment can also start in the middle of a line, with a blank and a #.
    bool trailing_comments = false;
  };

  /// The length limit of a line, in bytes. It protects against files that are not text.
  static constexpr std::size_t kMaxLine = 65'536;

  /// Reads the first line that is not blank. Errors begin with `name`.
  TableReader(std::istream& from, std::string name, const Options& options);
  TableReader(std::istream& from, std::string name) : TableReader(from, std::move(name), Options()) {}
  TableReader(TableReader&&) = default;

  /// A column, and the factor that converts its numbers to the requested unit.
  struct Column {
    std::size_t index = 0;
    double multiply = 1;
    double divide = 1;
  };

  /// The names of the columns. This is empty if the table has no header.
  const std::vector<std::string>& names() const noexcept { return names_; }
  /// The text of the first row or of the header.
  const std::string& first_line() const noexcept { return first_line_; }
  /// A comma, a semicolon, a tab or a blank.
  char separator() const noexcept { return separator_; }
  /// The number of cells in each row. It is 0 if the table is empty.
  std::size_t width() const noexcept { return width_; }
  /// The number of the current line. The first line is 1.
  std::size_t line() const noexcept { return line_number_; }

  /// Finds the column with this name, for example "x_mm". If there is no such column, it finds a column with the same
  /// name in another unit of the same kind, and converts its numbers. The unit can be written as "x_m", "X [m]", "x (m)"
  /// or "x/m". The names "time" and "timestamp" are the same as "t". Returns nothing if there is no such column. Throws
  /// if there are two.
  std::optional<Column> find(std::string_view name) const;
  /// Does the same, but throws if there is no such column.
  Column column(std::string_view name) const;
  /// Returns the column with this number, counted from 0. If the header gives the column another unit of the same kind
  /// as `unit`, its numbers are converted to `unit`.
  Column column(std::size_t index, std::string_view unit) const;
  /// Returns the number of the column that has exactly this name. Throws if there is no such column or if there are two.
  std::size_t index_of(std::string_view name) const;

  /// Reads the next row. Returns false at the end of the table.
  bool next_row();

  /// Returns the text of a cell in the current row, without quotes.
  std::string_view text(std::size_t column) const { return cells_.at(column).text; }
  /// Returns a number from the current row, or nothing if the cell is empty. Throws if it is not a finite number.
  std::optional<double> number(const Column& column);
  /// Does the same, but throws if the cell is empty.
  double needed_number(const Column& column);

  /// Throws an error that names the current line. Control characters are replaced.
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
  std::vector<char> buffer_ = std::vector<char>(kMaxLine + 1);  ///< the current line and a zero byte
  std::size_t line_number_ = 0;
  char separator_ = ',';
  std::vector<std::string> names_;
  std::string first_line_;
  std::size_t width_ = 0;
  std::vector<Cell> cells_;  ///< the current row, as views into buffer_ and unquoted_
  std::string unquoted_;
  bool first_row_waits_ = false;        ///< the first row has been read, but not returned yet
  std::size_t decimal_point_line_ = 0;  ///< the number of the first line with a decimal point, or 0
  std::size_t decimal_comma_line_ = 0;
};

}  // namespace tendon
