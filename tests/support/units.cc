// SPDX-License-Identifier: Apache-2.0
#include "tests/support/units.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace tendon {
namespace {

constexpr std::size_t kDigits = 16;  // of one half

bool whole(std::string_view text, std::uint64_t& value, int base = 10) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

std::string sixteen_digits(std::uint64_t value) {
  std::array<char, kDigits> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value, 16);
  const std::string text(digits.data(), end);
  return std::string(kDigits - text.size(), '0') + text;
}

template <class Value>
JsonLine object_of(const std::vector<std::pair<std::string, Value>>& figures) {
  JsonLine object;
  for (const auto& [name, value] : figures) object.add(name, value);
  return object;
}

template <class Value>
std::vector<std::pair<std::string, Value>> figures_of(const nlohmann::ordered_json& object) {
  std::vector<std::pair<std::string, Value>> figures;
  for (const auto& [name, value] : object.items()) figures.emplace_back(name, value.template get<Value>());
  return figures;
}

template <class Value, class Join>
void join(std::vector<std::pair<std::string, Value>>& sums, const std::vector<std::pair<std::string, Value>>& next,
          const Join& how) {
  if (sums.size() != next.size()) throw std::invalid_argument("the ends of two shards have other figures");
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (sums[i].first != next[i].first) {
      throw std::invalid_argument("the end of a shard has \"" + next[i].first + "\" where the one before has \"" +
                                  sums[i].first + "\"");
    }
    sums[i].second = how(sums[i].second, next[i].second);
  }
}

template <class Value>
Value& named(std::vector<std::pair<std::string, Value>>& figures, std::string_view name, Value first) {
  const auto found = std::ranges::find(figures, name, &std::pair<std::string, Value>::first);
  return found != figures.end() ? found->second : figures.emplace_back(name, first).second;
}

template <class Value>
Value figure(const std::vector<std::pair<std::string, Value>>& figures, std::string_view name) {
  const auto found = std::ranges::find(figures, name, &std::pair<std::string, Value>::first);
  if (found == figures.end()) throw std::invalid_argument("an end without \"" + std::string(name) + "\"");
  return found->second;
}

}  // namespace

Units parse_units(std::string_view text) {
  const auto colon = text.find(':');
  Units units;
  if (colon == std::string_view::npos || !whole(text.substr(0, colon), units.first) ||
      !whole(text.substr(colon + 1), units.count) || units.count == 0 ||
      units.first > std::numeric_limits<std::uint64_t>::max() - (units.count - 1)) {
    throw std::invalid_argument("units \"" + std::string(text) +
                                "\": expected FIRST:COUNT, two whole numbers with COUNT above 0, as 1:1000");
  }
  return units;
}

void UnitDigest::add(std::uint64_t unit, std::string_view outcome) noexcept {
  const XXH128_hash_t hash = XXH3_128bits_withSeed(outcome.data(), outcome.size(), unit);
  UnitDigest one;
  one.low_ = hash.low64;
  one.high_ = hash.high64;
  one.moment_ = unit * hash.low64;
  add(one);
}

void UnitDigest::add(const UnitDigest& other) noexcept {
  low_ += other.low_;
  high_ += other.high_ + (low_ < other.low_ ? 1U : 0U);
  moment_ += other.moment_;
}

std::string UnitDigest::text() const { return sixteen_digits(high_) + sixteen_digits(low_); }

std::string UnitDigest::moment() const { return sixteen_digits(moment_); }

UnitDigest UnitDigest::parse(std::string_view text, std::string_view moment) {
  UnitDigest digest;
  if (text.size() != 2 * kDigits || !whole(text.substr(0, kDigits), digest.high_, 16) ||
      !whole(text.substr(kDigits), digest.low_, 16)) {
    throw std::invalid_argument("digest \"" + std::string(text) + "\": expected 32 hexadecimal digits");
  }
  if (moment.size() != kDigits || !whole(moment, digest.moment_, 16)) {
    throw std::invalid_argument("moment \"" + std::string(moment) + "\": expected 16 hexadecimal digits");
  }
  return digest;
}

std::optional<std::uint64_t> UnitDigest::differs_at(const UnitDigest& other, const Units& units) const noexcept {
  if (*this == other) return std::nullopt;
  // If only unit u differs, the difference of the moments is u times the difference of the digests.
  const std::uint64_t apart = low_ - other.low_;
  const std::uint64_t moments_apart = moment_ - other.moment_;
  std::optional<std::uint64_t> found;
  for (std::uint64_t i = 0; i < units.count; ++i) {
    const std::uint64_t unit = units.first + i;
    if (unit * apart != moments_apart) continue;
    if (found) return std::nullopt;
    found = unit;
  }
  return found;
}

void ShardEnd::count(std::string_view name, std::uint64_t number) { named(totals, name, std::uint64_t{0}) += number; }

void ShardEnd::lower(std::string_view name, double value) {
  double& so_far = named(least, name, value);
  so_far = std::min(so_far, value);
}

void ShardEnd::raise(std::string_view name, double value) {
  double& so_far = named(largest, name, value);
  so_far = std::max(so_far, value);
}

void ShardEnd::add(const ShardEnd& next) {
  if (next.units.first != units.first + units.count) {
    throw std::invalid_argument("units " + std::to_string(next.units.first) + " and on come after " +
                                std::to_string(units.first + units.count - 1) + ": some are missing, or came twice");
  }
  units.count += next.units.count;
  join(totals, next.totals, [](std::uint64_t a, std::uint64_t b) { return a + b; });
  join(least, next.least, [](double a, double b) { return std::min(a, b); });
  join(largest, next.largest, [](double a, double b) { return std::max(a, b); });
  digest.add(next.digest);
}

std::string ShardEnd::line() const {
  return JsonLine()
      .add("kind", "end")
      .add("first", units.first)
      .add("count", units.count)
      .add("totals", object_of(totals))
      .add("least", object_of(least))
      .add("largest", object_of(largest))
      .add("digest", digest.text())
      .add("moment", digest.moment())
      .str();
}

ShardEnd ShardEnd::parse(std::string_view line) {
  try {
    const auto json = nlohmann::ordered_json::parse(line);
    if (json.at("kind") != "end") throw std::invalid_argument("another kind of line");
    return {.units = {.first = json.at("first"), .count = json.at("count")},
            .totals = figures_of<std::uint64_t>(json.at("totals")),
            .least = figures_of<double>(json.at("least")),
            .largest = figures_of<double>(json.at("largest")),
            .digest = UnitDigest::parse(json.at("digest").get<std::string>(), json.at("moment").get<std::string>())};
  } catch (const std::exception& error) {
    throw std::invalid_argument("the end of a shard, {\"kind\":\"end\",…}, was expected: " + std::string(error.what()));
  }
}

std::uint64_t ShardEnd::total(std::string_view name) const { return figure(totals, name); }
double ShardEnd::least_of(std::string_view name) const { return figure(least, name); }

std::optional<std::uint64_t> unit_of(std::string_view line) {
  constexpr std::string_view kBegin = R"({"unit":)";
  if (!line.starts_with(kBegin)) return std::nullopt;
  line.remove_prefix(kBegin.size());
  std::uint64_t unit = 0;
  if (!whole(line.substr(0, line.find_first_of(",}")), unit)) return std::nullopt;
  return unit;
}

void write_shard(const Units& units, std::uint64_t all,
                 const std::function<std::string(std::uint64_t unit, ShardEnd& end)>& run, std::ostream& out) {
  if (units.first >= all || units.count > all - units.first) {
    throw std::invalid_argument("units " + std::to_string(units.first) + ":" + std::to_string(units.count) +
                                ": expected some of 0 to " + std::to_string(all - 1));
  }
  ShardEnd end{.units = units};
  for (std::uint64_t unit = units.first; unit < units.first + units.count; ++unit) {
    const std::string lines = run(unit, end);
    end.digest.add(unit, lines);
    out << lines << std::flush;
  }
  out << end.line() << "\n";
  if (!out.flush()) throw std::runtime_error("cannot write the units: is the disk full?");
}

ShardEnd read_to_end(std::istream& lines, const std::function<void(const std::string& line)>& take) {
  std::optional<ShardEnd> end;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    try {
      if (end) throw std::invalid_argument("expected nothing after the end");
      if (line.starts_with(R"({"kind":"end",)")) {
        end = ShardEnd::parse(line);
      } else {
        take(line);
      }
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (!end) throw std::invalid_argument("no end of a sweep");
  return std::move(*end);
}

std::vector<std::string> read_shards(std::istream& lines, std::uint64_t all) {
  std::vector<std::string> units;
  const ShardEnd end = read_to_end(lines, [&](const std::string& line) {
    const auto unit = unit_of(line);
    if (!unit) throw std::invalid_argument("expected the line of a unit, {\"unit\":0,…}, or the end");
    if (*unit == units.size() && *unit < all) {
      units.push_back(line + "\n");
    } else if (!units.empty() && *unit == units.size() - 1) {
      units.back() += line + "\n";
    } else {
      throw std::invalid_argument("expected unit " + std::to_string(units.size()) + " of 0 to " +
                                  std::to_string(all - 1) + ", found " + std::to_string(*unit));
    }
  });
  if (units.size() != all) {
    throw std::invalid_argument(std::to_string(units.size()) + " units: expected all, 0 to " + std::to_string(all - 1));
  }
  UnitDigest digest;
  for (std::uint64_t unit = 0; unit < all; ++unit) digest.add(unit, units[unit]);
  if (digest != end.digest || end.units != Units{0, all}) {
    throw std::invalid_argument("the end is not that of the units before it");
  }
  return units;
}

}  // namespace tendon
