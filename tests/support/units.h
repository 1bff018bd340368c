// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <istream>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/json_line.h"

namespace tendon {

// What a program does that `tendon-sweep` can cut into shards. It numbers its work in units (a seed, a situation with
// all laws), takes `--units FIRST:COUNT --json`, and runs all of them: a broken promise is a result, not a reason to
// stop. It prints lines for each unit that is worth one, {"unit":17,…}, in their order, and one end line. What it prints
// depends on the units and the program alone: on no time, host, number of threads or order.
//
// swept_work.h does all of this for work whose every unit has a line.

/// A range of units.
struct Units {
  std::uint64_t first = 0;
  std::uint64_t count = 0;

  bool operator==(const Units&) const = default;
};

/// "FIRST:COUNT". Throws std::invalid_argument, saying what was expected, unless COUNT is 1 or more and the last unit
/// is a number of 64 bits.
Units parse_units(std::string_view text);

/// The sum modulo 2¹²⁸ of XXH3's 128-bit hash of each unit's whole outcome, with the unit's number as its seed. It is the
/// same however the units are cut, and in whatever order they come; it finds what tallies hide. Its moment, the sum
/// modulo 2⁶⁴ of each unit's number times the low half of its hash, is so too, and tells where two digests differ.
class UnitDigest {
 public:
  void add(std::uint64_t unit, std::string_view outcome) noexcept;
  void add(const UnitDigest& other) noexcept;
  /// 32 hexadecimal digits: the sum.
  std::string text() const;
  /// 16 hexadecimal digits.
  std::string moment() const;
  /// Of text() and moment(). Throws std::invalid_argument for anything else.
  static UnitDigest parse(std::string_view text, std::string_view moment);

  /// Of digests of the same units: the one in which they differ, if it is one; empty when they are the same, and when
  /// several units differ. A wrong answer has a chance of `units.count` in 2⁶⁴.
  std::optional<std::uint64_t> differs_at(const UnitDigest& other, const Units& units) const noexcept;

  bool operator==(const UnitDigest&) const = default;

 private:
  std::uint64_t low_ = 0;
  std::uint64_t high_ = 0;
  std::uint64_t moment_ = 0;
};

/// The end of a shard, or of many that are merged: whole numbers that add up, and extremes. No sum of numbers with a
/// fraction: its last bit would depend on the cut.
///
///     {"kind":"end","first":1,"count":500,"totals":{…},"least":{…},"largest":{…},"digest":"…","moment":"…"}
struct ShardEnd {
  Units units;
  std::vector<std::pair<std::string, std::uint64_t>> totals{};
  std::vector<std::pair<std::string, double>> least{};
  std::vector<std::pair<std::string, double>> largest{};
  UnitDigest digest{};

  /// What one more unit has of a figure. Each unit of a program names the same figures, with finite numbers.
  void count(std::string_view name, std::uint64_t number);
  void lower(std::string_view name, double value);
  void raise(std::string_view name, double value);

  /// The shard that follows this one. Throws std::invalid_argument when it does not follow, or has other names.
  void add(const ShardEnd& next);
  std::string line() const;
  /// Of line(). Throws std::invalid_argument for anything else.
  static ShardEnd parse(std::string_view line);

  /// Throws std::invalid_argument for a name that is not there.
  std::uint64_t total(std::string_view name) const;
  double least_of(std::string_view name) const;
};

/// The number of a unit that a line begins with, {"unit":17,…}; empty when it begins with something else.
std::optional<std::uint64_t> unit_of(std::string_view line);

/// Runs `units` of the `all` that there are, numbered from 0, and prints their lines and their end. `run` gives a unit's
/// lines, each with its '\n', and counts it; the digest is of these lines. Throws std::invalid_argument when there are no
/// such units, std::runtime_error when `out` fails.
void write_shard(const Units& units, std::uint64_t all,
                 const std::function<std::string(std::uint64_t unit, ShardEnd& end)>& run, std::ostream& out);

/// The lines of one shard, or of many that were merged: `take` gets all but the end. Throws std::invalid_argument, naming
/// the line, when `take` does, and when the end is missing or not the last.
ShardEnd read_to_end(std::istream& lines, const std::function<void(const std::string& line)>& take);

/// The lines of each of the units 0 to `all` − 1, that write_shard has printed in one shard or in many that were merged.
/// Throws std::invalid_argument, naming the line or unit, unless they are all there, once, with an end whose digest is
/// theirs.
std::vector<std::string> read_shards(std::istream& lines, std::uint64_t all);

}  // namespace tendon
