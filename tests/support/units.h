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

// Work that `tendon-sweep` can split into shards. The program numbers its work in units (a seed, a situation with all
// laws) and accepts `--units FIRST:COUNT --json`. It runs all of them, because a broken promise is a result, and prints
// lines {"unit":17,…} in their order and one end line. The output must depend only on the units and the program, not on
// time, host, number of threads or order. swept_work.h implements this.

struct Units {
  std::uint64_t first = 0;
  std::uint64_t count = 0;

  bool operator==(const Units&) const = default;
};

/// "FIRST:COUNT". Throws std::invalid_argument with the expected format unless COUNT ≥ 1 and the last unit fits into 64
/// bits.
Units parse_units(std::string_view text);

/// The sum modulo 2¹²⁸ of XXH3's 128-bit hash of each unit's whole outcome, with the unit's number as the seed. It does
/// not depend on the partition or order of the units, and detects differences that totals hide. The moment, the sum
/// modulo 2⁶⁴ of each unit's number times the low half of its hash, has the same property and locates a difference.
class UnitDigest {
 public:
  void add(std::uint64_t unit, std::string_view outcome) noexcept;
  void add(const UnitDigest& other) noexcept;
  /// Returns the sum as 32 hexadecimal digits.
  std::string text() const;
  std::string moment() const;
  /// Throws std::invalid_argument if the input is malformed.
  static UnitDigest parse(std::string_view text, std::string_view moment);

  /// Returns the unit if two digests of the same units differ in one unit, and nullopt otherwise. The probability that
  /// the result is wrong is `units.count`/2⁶⁴.
  std::optional<std::uint64_t> differs_at(const UnitDigest& other, const Units& units) const noexcept;

  bool operator==(const UnitDigest&) const = default;

 private:
  std::uint64_t low_ = 0;
  std::uint64_t high_ = 0;
  std::uint64_t moment_ = 0;
};

/// All totals and extremes are integers. The last bit of a floating-point sum would depend on the partition.
///
///     {"kind":"end","first":1,"count":500,"totals":{…},"least":{…},"largest":{…},"digest":"…","moment":"…"}
struct ShardEnd {
  Units units;
  std::vector<std::pair<std::string, std::uint64_t>> totals{};
  std::vector<std::pair<std::string, double>> least{};
  std::vector<std::pair<std::string, double>> largest{};
  UnitDigest digest{};

  /// All units of a program must use the same names and finite numbers.
  void count(std::string_view name, std::uint64_t number);
  void lower(std::string_view name, double value);
  void raise(std::string_view name, double value);

  /// Throws std::invalid_argument if the shard is not contiguous or has different names.
  void add(const ShardEnd& next);
  std::string line() const;
  /// Throws std::invalid_argument if the input is malformed.
  static ShardEnd parse(std::string_view line);

  /// Throws std::invalid_argument for an unknown name.
  std::uint64_t total(std::string_view name) const;
  double least_of(std::string_view name) const;
};

/// Returns nullopt for lines other than {"unit":17,…}.
std::optional<std::uint64_t> unit_of(std::string_view line);

/// Runs `units` out of the units 0 to `all` − 1. `run` must return the lines of a unit, each with '\n', and count the
/// unit. The digest is computed from these lines. Throws std::invalid_argument if the units do not exist, and
/// std::runtime_error if `out` fails.
void write_shard(const Units& units, std::uint64_t all,
                 const std::function<std::string(std::uint64_t unit, ShardEnd& end)>& run, std::ostream& out);

/// Calls `take` for all but the end line. Throws std::invalid_argument that names the line if `take` throws, or if the
/// end line is missing or not the last.
ShardEnd read_to_end(std::istream& lines, const std::function<void(const std::string& line)>& take);

/// Returns the lines of each of the units 0 to `all` − 1, from one shard or from merged shards. Throws
/// std::invalid_argument that names the line or unit unless each unit is present once and the digest of the end line
/// matches.
std::vector<std::string> read_shards(std::istream& lines, std::uint64_t all);

}  // namespace tendon
