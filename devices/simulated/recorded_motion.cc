// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/recorded_motion.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "core/base/expect.h"

namespace tendon {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// The cell with this number, from 0; empty when the line has fewer cells.
std::optional<std::string_view> cell(std::string_view line, std::size_t number) {
  for (; number > 0; --number) {
    const auto comma = line.find(',');
    if (comma == std::string_view::npos) return std::nullopt;
    line.remove_prefix(comma + 1);
  }
  return trimmed(line.substr(0, line.find(',')));
}

std::optional<double> finite_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

class Reader {
 public:
  Reader(std::istream& csv, const RecordedMotionFile& file) : file_(file), stream_(csv) {
    const bool named =
        std::holds_alternative<std::string>(file.time) || std::holds_alternative<std::string>(file.position);
    if (named && !next_line()) fail("expected a header line, found an empty file");
    time_ = number_of(file.time);
    position_ = number_of(file.position);
  }

  ScriptedMotion::Recorded samples() {
    ScriptedMotion::Recorded motion{{}, file_.origin, file_.direction, file_.at_end};
    while (next_line()) {
      const ScriptedMotion::Recorded::Sample sample{number(time_), number(position_) * file_.scale};
      if (!motion.samples.empty() && !(sample.t > motion.samples.back().t)) {
        fail("expected a time after that of the sample before, found '" + std::string(*cell(line_, time_)) + "'");
      }
      if (motion.samples.size() == kMaxRecordedSamples) {
        fail("expected at most " + std::to_string(kMaxRecordedSamples) + " samples, found more");
      }
      motion.samples.push_back(sample);
    }
    if (motion.samples.size() < 2) {
      fail("expected 2 samples or more, found " + std::to_string(motion.samples.size()));
    }
    return motion;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(file_.path.string() + ":" + std::to_string(line_number_) + ": " + what);
  }

  /// Skips blank lines: many programs end a file with one.
  bool next_line() {
    while (stream_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()))) {
      ++line_number_;
      line_ = std::string_view(buffer_.data(), static_cast<std::size_t>(stream_.gcount()) - (stream_.eof() ? 0 : 1));
      if (!trimmed(line_).empty()) return true;
    }
    if (stream_.gcount() + 1 == static_cast<std::streamsize>(buffer_.size())) {
      ++line_number_;
      fail("expected lines of at most " + std::to_string(kMaxRecordedLine) + " bytes, found a longer one");
    }
    if (stream_.bad()) fail("expected more lines, the file cannot be read on");
    return false;
  }

  /// The number of a column. The header must be the current line.
  std::size_t number_of(const RecordedMotionFile::Column& column) const {
    if (const auto* number = std::get_if<std::size_t>(&column)) return *number;
    const auto& name = std::get<std::string>(column);
    for (std::size_t i = 0;; ++i) {
      const auto found = cell(line_, i);
      if (!found) fail("expected a column '" + name + "', found '" + std::string(trimmed(line_)) + "'");
      if (*found == name) return i;
    }
  }

  double number(std::size_t column) const {
    const auto text = cell(line_, column);
    const std::string where = "expected a finite number in column " + std::to_string(column) + " (from 0), found ";
    if (!text) fail(where + "a line that ends before it");
    const auto value = finite_number(*text);
    if (!value) fail(where + "'" + std::string(*text) + "'");
    return *value;
  }

  const RecordedMotionFile& file_;
  std::istream& stream_;
  std::vector<char> buffer_ = std::vector<char>(kMaxRecordedLine + 1);  ///< with room for the closing zero
  std::string_view line_;                                               ///< in buffer_
  std::size_t line_number_ = 0;
  std::size_t time_ = 0;
  std::size_t position_ = 0;
};

}  // namespace

ScriptedMotion::Recorded load_recorded_motion(std::istream& csv, const RecordedMotionFile& file) {
  expect(std::isfinite(file.scale) && file.scale != 0, "recorded.scale", file.scale, "a number that is not 0");
  return Reader(csv, file).samples();
}

}  // namespace tendon
