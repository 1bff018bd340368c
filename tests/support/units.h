// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/json_line.h"

namespace tendon {

// What a program does that `tendon-sweep` can cut into shards. It numbers its work in units (a seed, a situation with
// all laws), takes `--units FIRST:COUNT --json`, and runs all of them: a broken promise is a result, not a reason to
// stop. It prints a line for each unit that is worth one, in their order, and one end line. What it prints depends on
// the units and the program alone: on no time, host, number of threads or order.

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
/// same however the units are cut, and in whatever order they come; it finds what tallies hide.
class UnitDigest {
 public:
  void add(std::uint64_t unit, std::string_view outcome) noexcept;
  void add(const UnitDigest& other) noexcept;
  /// 32 hexadecimal digits.
  std::string text() const;
  /// Of text(). Throws std::invalid_argument for anything else.
  static UnitDigest parse(std::string_view text);

 private:
  std::uint64_t low_ = 0;
  std::uint64_t high_ = 0;
};

/// The end of a shard, or of many that are merged: whole numbers that add up, and extremes. No sum of numbers with a
/// fraction: its last bit would depend on the cut.
///
///     {"kind":"end","first":1,"count":500,"totals":{…},"least":{…},"largest":{…},"digest":"…"}
struct ShardEnd {
  Units units;
  std::vector<std::pair<std::string, std::uint64_t>> totals{};
  std::vector<std::pair<std::string, double>> least{};
  std::vector<std::pair<std::string, double>> largest{};
  UnitDigest digest{};

  /// The shard that follows this one. Throws std::invalid_argument when it does not follow, or has other names.
  void add(const ShardEnd& next);
  std::string line() const;
  /// Of line(). Throws std::invalid_argument for anything else.
  static ShardEnd parse(std::string_view line);

  /// Throws std::invalid_argument for a name that is not there.
  std::uint64_t total(std::string_view name) const;
  double least_of(std::string_view name) const;
};

}  // namespace tendon
