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

/// The part of this process. If neither `units` nor `from` is set, this is all units (part_options.h).
struct Part {
  std::optional<Units> units{};                 ///< the units of this shard
  std::optional<std::filesystem::path> from{};  ///< the file with the results of the shards
  bool progress = false;
};

/// A program defines a unit and how its outcome is written and read. outcomes() does the rest.
template <class Outcome>
struct SweptWork {
  std::string_view what;    ///< plural name of the units, for example "situations"
  std::uint64_t units = 0;  ///< number of units, from 0
  std::function<Outcome(std::uint64_t unit)> run{};
  /// One or more lines without the unit's number. They must contain everything that the evaluation needs.
  std::function<std::vector<JsonLine>(std::uint64_t unit, const Outcome& outcome)> lines{};
  /// May throw any exception for input that is not from lines().
  std::function<Outcome(std::uint64_t unit, const std::vector<nlohmann::json>& lines)> read{};
  std::function<void(const Outcome& outcome, ShardEnd& end)> count{};
};

/// Returns NaN if JsonLine wrote null.
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

/// Throws std::invalid_argument if the lines are not those of the parsed outcome.
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

/// Returns all outcomes in the order of the units, computed here or read from the lines of a sweep; nullopt for a
/// shard, whose lines are then on `out`. Calls `each` as each outcome becomes available. Throws std::invalid_argument
/// if the units do not exist or a line is not of this program with these arguments. Passes exceptions of the work on.
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
