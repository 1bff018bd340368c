// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/json_line.h"
#include "tests/support/units.h"

namespace tendon {

/// Which part of its work a process is asked for (part_options.h has it from the command line): all, unless one of
/// `units` and `from` is there.
struct Part {
  std::optional<Units> units{};                 ///< these, as a shard of a sweep
  std::optional<std::filesystem::path> from{};  ///< none: what the shards of a sweep came to is in this file
  bool progress = false;                        ///< is told on standard error
};

/// Work that can be swept. A program says what a unit is and how its outcome is written and read; outcomes() does the
/// rest, whichever part is asked for.
template <class Outcome>
struct SweptWork {
  std::string_view what;    ///< the units are: "situations"
  std::uint64_t units = 0;  ///< … numbered from 0
  std::function<Outcome(std::uint64_t unit)> run{};
  /// One or more, without the unit's number. They have all of an outcome that the program's judgement needs.
  std::function<std::vector<JsonLine>(std::uint64_t unit, const Outcome& outcome)> lines{};
  /// Reads what lines() wrote. May throw whatever it likes for anything else.
  std::function<Outcome(std::uint64_t unit, const std::vector<nlohmann::json>& lines)> read{};
  /// Adds an outcome to the totals and extremes of a shard.
  std::function<void(const Outcome& outcome, ShardEnd& end)> count{};
};

/// A number of a line; NaN where JsonLine has written null.
inline double number_of(const nlohmann::json& line, const std::string& key) {
  const nlohmann::json& value = line.at(key);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

namespace swept {

template <class Outcome>
std::string text_of(const SweptWork<Outcome>& work, std::uint64_t unit, const Outcome& outcome) {
  std::string text;
  for (const JsonLine& line : work.lines(unit, outcome)) {
    text += JsonLine().add("unit", unit).add_all(line).str() + "\n";
  }
  return text;
}

/// Throws std::invalid_argument unless this work writes the same of what it has read.
template <class Outcome>
Outcome outcome_of(const SweptWork<Outcome>& work, std::uint64_t unit, const std::string& text) {
  const std::string name = "unit " + std::to_string(unit) + " of the " + std::string(work.what) + ": ";
  std::vector<nlohmann::json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(nlohmann::json::parse(line, nullptr, false));
  std::optional<Outcome> outcome;
  try {
    outcome = work.read(unit, lines);
  } catch (const std::exception& error) {
    throw std::invalid_argument(name + error.what() + ", in " + text);
  }
  if (text_of(work, unit, *outcome) != text) {
    throw std::invalid_argument(name + "expected what this build writes with these arguments, found " + text);
  }
  return std::move(*outcome);
}

}  // namespace swept

/// All outcomes, in the order of their units: of this process, or from the lines of a sweep. Empty when the part is a
/// shard: its lines are on `out` now, and there is nothing to judge. `each` sees them one by one, as they come.
/// Throws std::invalid_argument when there are no such units, and when a line is not what this program writes with these
/// arguments; what the work throws.
template <class Outcome>
std::optional<std::vector<Outcome>> outcomes(const SweptWork<Outcome>& work, const Part& part, std::ostream& out,
                                             const std::function<void(const Outcome& outcome)>& each = {}) {
  std::uint64_t done = 0;
  const auto run = [&](std::uint64_t unit, std::uint64_t of) {
    Outcome outcome = work.run(unit);
    if (part.progress) std::cerr << "\r\x1b[K" << ++done << " of " << of << " " << work.what << std::flush;
    if (part.progress && done == of) std::cerr << "\r\x1b[K" << std::flush;
    return outcome;
  };
  if (part.units) {
    const auto write = [&](std::uint64_t unit, ShardEnd& end) {
      const Outcome outcome = run(unit, part.units->count);
      work.count(outcome, end);
      return swept::text_of(work, unit, outcome);
    };
    write_shard(*part.units, work.units, write, out);
    return std::nullopt;
  }
  std::vector<std::string> texts;
  if (part.from) {
    std::ifstream lines(*part.from);
    if (!lines) throw std::runtime_error(part.from->string() + ": cannot be read");
    texts = read_shards(lines, work.units);
  }
  std::vector<Outcome> all;
  for (std::uint64_t unit = 0; unit < work.units; ++unit) {
    all.push_back(part.from ? swept::outcome_of(work, unit, texts[unit]) : run(unit, work.units));
    if (each) each(all.back());
  }
  return all;
}

}  // namespace tendon
