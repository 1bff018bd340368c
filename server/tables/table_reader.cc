// SPDX-License-Identifier: Apache-2.0
#include "server/tables/table_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "protocol/byte_order_mark.h"

namespace tendon {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::string shown(std::string_view text) {
  constexpr std::size_t kShown = 60;
  return "'" + std::string(text.substr(0, kShown)) + (text.size() > kShown ? "…'" : "'");
}

std::optional<double> plain_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> number_with_comma(std::string_view text) {
  const auto comma = text.find(',');
  if (comma == std::string_view::npos || text.find_first_of(",.", comma + 1) != std::string_view::npos ||
      text.substr(0, comma).find('.') != std::string_view::npos) {
    return std::nullopt;
  }
  std::string with_point(text);
  with_point[comma] = '.';
  return plain_number(with_point);
}

/// True for a number like "1,012", whose comma could be a thousands separator.
bool may_separate_thousands(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  const auto comma = text.find(',');
  return comma >= 1 && comma <= 3 && text.size() == comma + 4 && text.front() != '0' &&
         std::ranges::all_of(text.substr(0, comma), is_digit) && std::ranges::all_of(text.substr(comma + 1), is_digit);
}

/// Returns true if this cannot be the name of a column. This includes nan and inf, which are used by some loggers.
bool is_numeric(std::string_view text) {
  const std::string small = lower(text);
  const std::string_view size =
      std::string_view(small).substr(small.starts_with('-') || small.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) return true;
  return plain_number(text) || number_with_comma(text) || size == "nan" || size == "inf" || size == "infinity";
}

bool is_plain_name(std::string_view text) {
  return !text.empty() && !is_digit(text.front()) &&
         std::ranges::all_of(text, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
}

enum class Kind { kTime, kLength, kForce, kTorque, kAngle };

struct Unit {
  std::string_view symbol;
  Kind kind;
  double per_si;
};

constexpr std::array kUnits = {
    Unit{"s", Kind::kTime, 1},
    Unit{"ms", Kind::kTime, 1e3},
    Unit{"us", Kind::kTime, 1e6},
    Unit{"µs", Kind::kTime, 1e6},
    Unit{"μs", Kind::kTime, 1e6},
    Unit{"ns", Kind::kTime, 1e9},
    Unit{"m", Kind::kLength, 1},
    Unit{"cm", Kind::kLength, 1e2},
    Unit{"mm", Kind::kLength, 1e3},
    Unit{"um", Kind::kLength, 1e6},
    Unit{"µm", Kind::kLength, 1e6},
    Unit{"μm", Kind::kLength, 1e6},
    Unit{"n", Kind::kForce, 1},
    Unit{"mn", Kind::kForce, 1e3},
    Unit{"nm", Kind::kTorque, 1},
    Unit{"n·m", Kind::kTorque, 1},
    Unit{"mnm", Kind::kTorque, 1e3},
    Unit{"rad", Kind::kAngle, 1},
    Unit{"mrad", Kind::kAngle, 1e3},
    Unit{"deg", Kind::kAngle, 180 / std::numbers::pi},
    Unit{"°", Kind::kAngle, 180 / std::numbers::pi},
};

const Unit* unit_of(std::string_view symbol) {
  const auto* const found = std::ranges::find(kUnits, symbol, &Unit::symbol);
  return found == kUnits.end() ? nullptr : found;
}

struct Named {
  std::string stem;
  const Unit* unit = nullptr;
};

Named named(std::string_view cell) {
  const std::string name = lower(trimmed(cell));
  const std::string_view all = name;
  std::size_t at = std::string::npos;
  std::string_view symbol;
  if (all.ends_with(']') || all.ends_with(')')) {
    at = all.find_last_of("[(");
    if (at != std::string::npos) symbol = all.substr(at + 1, all.size() - at - 2);
  } else {
    at = all.find_last_of("_/");
    if (at != std::string::npos) symbol = all.substr(at + 1);
  }
  const Unit* const unit = unit_of(trimmed(symbol));
  std::string stem(unit == nullptr ? all : trimmed(all.substr(0, at)));
  if (stem == "time" || stem == "timestamp") stem = "t";
  return {std::move(stem), unit};
}

TableReader::Column converted(std::size_t index, const Unit* from, const Unit* to) {
  TableReader::Column column{.index = index};
  if (from == nullptr || to == nullptr || from->kind != to->kind) return column;
  // Rounds only once. Multiplying by 0.001 would round twice.
  if (to->per_si >= from->per_si) {
    column.multiply = to->per_si / from->per_si;
  } else {
    column.divide = from->per_si / to->per_si;
  }
  return column;
}

}  // namespace

TableReader::TableReader(std::istream& from, std::string name, const Options& options)
    : from_(from), name_(std::move(name)), options_(options) {
  read_first_row();
}

void TableReader::fail(std::string sentence) const {
  // The message may contain control characters from the file.
  std::ranges::replace_if(
      sentence, [](unsigned char c) { return std::iscntrl(c) != 0; }, '?');
  throw std::runtime_error(name_ + ':' + std::to_string(std::max<std::size_t>(line_number_, 1)) + ": " + sentence);
}

std::optional<std::string_view> TableReader::next_line() {
  if (from_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()))) {
    ++line_number_;
    const auto bytes = static_cast<std::size_t>(from_.gcount()) - (from_.eof() ? 0 : 1);
    std::string_view line(buffer_.data(), bytes);
    if (line_number_ == 1) {
      if (line.starts_with("\xff\xfe") || line.starts_with("\xfe\xff")) {
        fail("expected text in UTF-8, found UTF-16: save it as \"CSV UTF-8\"");
      }
      line = without_byte_order_mark(line);
    }
    return line;
  }
  if (from_.gcount() + 1 == static_cast<std::streamsize>(buffer_.size())) {
    ++line_number_;
    fail("expected lines of at most " + std::to_string(kMaxLine) + " bytes, found a longer one");
  }
  if (from_.bad()) fail("cannot read the rest of the file");
  return std::nullopt;
}

std::string_view TableReader::uncommented(std::string_view line) const {
  if (trimmed(line).starts_with('#')) return {};
  if (!options_.trailing_comments) return line;
  for (std::size_t at = line.find('#'); at != std::string_view::npos; at = line.find('#', at + 1)) {
    if (kBlanks.find(line[at - 1]) != std::string_view::npos) return line.substr(0, at);
  }
  return line;
}

void TableReader::split(std::string_view line) {
  cells_.clear();
  unquoted_.clear();
  const std::string_view around = separator_ == '\t' ? " \r" : kBlanks;
  if (separator_ == ' ') line = trimmed(line);
  for (;;) {
    const auto start = std::min(line.find_first_not_of(around), line.size());
    if (start == line.size() || line[start] != '"') {
      const auto end = std::min(line.find(separator_), line.size());
      cells_.push_back({trimmed(line.substr(0, end)), false});
      if (end == line.size()) return;
      line.remove_prefix(end + 1);
    } else {
      const auto begin = unquoted_.size();
      auto at = start + 1;
      for (;; ++at) {
        if (at >= line.size()) fail("expected a closing quote in the same line, found " + shown(line));
        if (line[at] == '"' && (at + 1 == line.size() || line[at + 1] != '"')) break;
        if (line[at] == '"') ++at;
        unquoted_.push_back(line[at]);
      }
      cells_.push_back({trimmed(std::string_view(unquoted_).substr(begin)), true});
      const auto next = std::min(line.find_first_not_of(around, at + 1), line.size());
      if (next == line.size()) return;
      if (line[next] != separator_ && separator_ != ' ') {
        fail("expected a separator after a cell in quotes, found " + shown(line.substr(next)));
      }
      line.remove_prefix(separator_ == ' ' ? next : next + 1);
    }
    if (separator_ == ' ') line = line.substr(std::min(line.find_first_not_of(kBlanks), line.size()));
  }
}

void TableReader::read_first_row() {
  unquoted_.reserve(kMaxLine);  // referenced by cells_, so it must not be reallocated
  std::optional<std::string_view> line;
  std::string_view row;
  do {
    line = next_line();
    if (!line) return;
    row = uncommented(*line);
  } while (trimmed(row).empty());

  const auto choose_separator = [this](std::string_view text) {
    const auto separates = [](std::string_view cells, char separator) {
      bool quoted = false;
      return std::ranges::any_of(cells, [&](char c) {
        quoted = c == '"' ? !quoted : quoted;
        return c == separator && !quoted;
      });
    };
    for (const char each : {';', '\t', ','}) {
      separator_ = each;
      if (separates(text, each)) return;  // not trimmed because the last cell can be empty
    }
    separator_ = ' ';
    split(text);
    const bool words = std::ranges::all_of(
        cells_, [](const Cell& cell) { return !cell.quoted && (is_numeric(cell.text) || is_plain_name(cell.text)); });
    if (!words || cells_.size() == 1) separator_ = ',';  // a single column like "Delay [ms]"
  };
  const auto has_numbers = [this] {
    return std::ranges::any_of(cells_, [](const Cell& cell) { return is_numeric(cell.text); });
  };
  choose_separator(row);
  split(row);
  if (!has_numbers()) {  // names can contain a #
    row = *line;
    choose_separator(row);
    split(row);
  }
  width_ = cells_.size();
  first_line_ = trimmed(row);
  first_row_waits_ = has_numbers();
  if (first_row_waits_) return;
  for (const Cell& cell : cells_) names_.emplace_back(cell.text);
}

bool TableReader::next_row() {
  if (first_row_waits_) {
    first_row_waits_ = false;
    return true;
  }
  while (const auto line = next_line()) {
    const std::string_view row = uncommented(*line);
    if (trimmed(row).empty()) {
      // A line that only contains a comment is not a row.
      if (width_ != 1 || !options_.blank_lines_are_cells || !trimmed(*line).empty()) continue;
      cells_.assign(1, Cell{});
      return true;
    }
    split(row);
    if (cells_.size() == width_) return true;
    const bool commas = separator_ == ',' && cells_.size() > width_;
    fail("expected " + std::to_string(width_) + (width_ == 1 ? " cell" : " cells") + " as in the first row, found " +
         std::to_string(cells_.size()) +
         (commas ? "; are these decimal commas? Use decimal points, or separate the cells by semicolons" : ""));
  }
  return false;
}

std::size_t TableReader::index_of(std::string_view name) const {
  const auto found = std::ranges::find(names_, name);
  if (found == names_.end()) {
    if (width_ == 0) fail("expected a header line with a column " + shown(name) + ", found an empty file");
    fail("expected a header line with a column " + shown(name) + ", found " + shown(first_line_));
  }
  if (std::find(found + 1, names_.end(), name) != names_.end())
    fail("expected one column " + shown(name) + ", found two");
  return static_cast<std::size_t>(found - names_.begin());
}

std::optional<TableReader::Column> TableReader::find(std::string_view name) const {
  if (std::ranges::find(names_, name) != names_.end()) return Column{.index = index_of(name)};
  const Named wanted = named(name);
  std::optional<Column> found;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const Named here = named(names_[i]);
    if (here.stem != wanted.stem || here.unit == nullptr || wanted.unit == nullptr ||
        here.unit->kind != wanted.unit->kind) {
      continue;
    }
    if (found) fail("expected one column " + shown(name) + ", found two: " + shown(first_line_));
    found = converted(i, here.unit, wanted.unit);
  }
  return found;
}

TableReader::Column TableReader::column(std::string_view name) const {
  if (const auto found = find(name)) return *found;
  return {.index = index_of(name)};  // always throws
}

TableReader::Column TableReader::column(std::size_t index, std::string_view unit) const {
  return converted(index, index < names_.size() ? named(names_[index]).unit : nullptr, tendon::unit_of(unit));
}

void TableReader::refuse_number(std::size_t column) const {
  const std::string place = !names_.empty() ? " as " + names_[column]
                            : width_ > 1    ? " in column " + std::to_string(column) + " (from 0)"
                                            : "";
  fail("expected a finite number" + place + ", found " + shown(cells_[column].text));
}

double TableReader::value_of(std::size_t column) {
  const std::string_view text = cells_[column].text;
  if (const auto value = plain_number(text)) {
    const bool point = text.find('.') != std::string_view::npos;
    if (point && decimal_comma_line_ != 0) {
      fail("expected a decimal comma as in line " + std::to_string(decimal_comma_line_) + ", found " + shown(text));
    }
    if (point && decimal_point_line_ == 0) decimal_point_line_ = line_number_;
    return *value;
  }
  const auto value = number_with_comma(text);
  if (!value) {
    const bool thousands = text.find(',') != std::string_view::npos &&
                           std::ranges::all_of(text, [](char c) { return is_digit(c) || c == ',' || c == '.'; });
    if (thousands) fail("expected a number without thousands separators, found " + shown(text));
    refuse_number(column);
  }
  if (decimal_point_line_ != 0) {
    fail("expected a decimal point as in line " + std::to_string(decimal_point_line_) + ", found " + shown(text));
  }
  if (decimal_comma_line_ == 0 && separator_ != ';' && may_separate_thousands(text)) {
    std::string whole(text);
    std::string part(text);
    whole.erase(whole.find(','), 1);
    part[part.find(',')] = '.';
    fail("expected a decimal point, found " + shown(text) + ": is it " + part + " or " + whole + "?");
  }
  if (decimal_comma_line_ == 0) decimal_comma_line_ = line_number_;
  return *value;
}

std::optional<double> TableReader::number(const Column& column) {
  if (column.index >= cells_.size()) {
    fail("expected a finite number in column " + std::to_string(column.index) + " (from 0), found " +
         std::to_string(cells_.size()) + (cells_.size() == 1 ? " cell" : " cells"));
  }
  if (cells_[column.index].text.empty()) return std::nullopt;
  const double value = value_of(column.index) * column.multiply / column.divide;
  if (!std::isfinite(value)) refuse_number(column.index);
  return value;
}

double TableReader::needed_number(const Column& column) {
  if (const auto value = number(column)) return *value;
  refuse_number(column.index);
}

}  // namespace tendon
