// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/ramp_csv.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include "server/machine/regular_file.h"

namespace tendon::lab {
namespace {

constexpr std::size_t kMaxRows = 4'000'000;  // more than an hour at 1 kHz: a wrong path may lead to anything

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (;;) {
    const auto comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

std::optional<double> finite_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

class Reader {
 public:
  Reader(std::istream& in, const std::string& name, const FreedomInfo& freedom)
      : in_(in), name_(name), columns_{"t_s", freedom.position, freedom.effort} {}

  RampRun run() {
    if (!next_line())
      fail("expected a header line with t_s, " + std::string(columns_[1]) + " and " + std::string(columns_[2]) +
           ", found nothing");
    find_columns();
    RampRun run;
    while (next_line()) {
      const RampSample sample{number(0), number(1), number(2)};
      if (!run.samples.empty() && !(sample.t > run.samples.back().t)) {
        fail("expected a time after that of the row before, found '" + std::string(cells_[where_[0]]) + "'");
      }
      if (run.samples.size() == kMaxRows) fail("expected at most " + std::to_string(kMaxRows) + " rows, found more");
      run.samples.push_back(sample);
    }
    if (in_.bad()) fail("cannot read on");
    return run;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(name_ + ":" + std::to_string(line_number_) + ": " + what);
  }

  bool next_line() {
    while (std::getline(in_, line_)) {
      ++line_number_;
      if (trimmed(line_).empty()) continue;
      split(line_, cells_);
      return true;
    }
    return false;
  }

  void find_columns() {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      std::optional<std::size_t> found;
      for (std::size_t j = 0; j < cells_.size(); ++j) {
        if (cells_[j] != columns_.at(i)) continue;
        if (found) fail("expected one column '" + std::string(columns_.at(i)) + "', found two");
        found = j;
      }
      if (!found) {
        fail("expected a header line with a column '" + std::string(columns_.at(i)) + "', found '" +
             std::string(trimmed(line_)) + "'");
      }
      where_.at(i) = *found;
    }
  }

  double number(std::size_t column) const {
    const std::string what = "expected a finite number as " + std::string(columns_.at(column));
    if (where_.at(column) >= cells_.size()) fail(what + ", found the end of the line");
    const std::string_view cell = cells_[where_.at(column)];
    const auto value = finite_number(cell);
    if (!value) fail(what + ", found '" + std::string(cell) + "'");
    return *value;
  }

  std::istream& in_;
  const std::string& name_;
  std::string line_;
  std::vector<std::string_view> cells_;  ///< of line_
  std::size_t line_number_ = 0;
  std::array<std::string_view, 3> columns_;
  std::array<std::size_t, 3> where_{};
};

}  // namespace

RampRun read_ramp_csv(std::istream& in, const std::string& name, Freedom freedom) {
  return Reader(in, name, info(freedom)).run();
}

RampRun load_ramp_csv(const std::filesystem::path& file, Freedom freedom) {
  std::ifstream in = open_regular_file(file, "ramp run");
  return read_ramp_csv(in, file.string(), freedom);
}

}  // namespace tendon::lab
