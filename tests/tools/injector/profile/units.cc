// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/units.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <system_error>

#include "tests/tools/injector/models/exact_math.h"

namespace tendon::injector {
namespace {

std::string number_text(double value, std::chars_format format) {
  std::array<char, 512> text{};  // the smallest double has 327 characters in fixed notation
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value, format);
  return {text.data(), end};
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Duration> to_duration(double value, double unit_ns) {
  const double ns = value * unit_ns;
  // More than a day is not a delay, and more than 2⁶³ ns overflows.
  if (std::abs(ns) > 86'400e9) return std::nullopt;
  return Duration(exact::round(ns));
}

std::optional<Duration> parse_duration(std::string_view text) {
  struct Unit {
    std::string_view name;
    double ns;
  };
  // "s" is last, because it is a suffix of the other units.
  constexpr std::array<Unit, 4> kUnits = {Unit{"ns", 1}, Unit{"us", 1e3}, Unit{"ms", 1e6}, Unit{"s", 1e9}};
  for (const Unit& unit : kUnits) {
    if (!text.ends_with(unit.name)) continue;
    const std::optional<double> value = parse_number(text.substr(0, text.size() - unit.name.size()));
    return value ? to_duration(*value, unit.ns) : std::nullopt;
  }
  return std::nullopt;
}

std::string duration_text(Duration duration) {
  const std::uint64_t ns = static_cast<std::uint64_t>(std::abs(duration.count()));
  const bool whole_seconds = ns != 0 && ns % 1'000'000'000 == 0;
  const std::uint64_t unit = whole_seconds ? 1'000'000'000 : 1'000'000;
  std::string text = (duration.count() < 0 ? "-" : "") + std::to_string(ns / unit);
  if (ns % unit != 0) {
    std::string decimals = std::to_string(1'000'000 + ns % unit).substr(1);
    decimals.erase(decimals.find_last_not_of('0') + 1);
    text += "." + decimals;
  }
  return text + (whole_seconds ? "s" : "ms");
}

std::optional<double> parse_probability(std::string_view text) {
  if (!text.ends_with('%')) return parse_number(text);
  text.remove_suffix(1);
  if (text.find_first_not_of("-0123456789.") != std::string_view::npos) return std::nullopt;
  // Shifts the decimal point in the text instead of dividing, so that 7% is exactly the double 0.07.
  return parse_number(std::string(text) + "e-2");
}

std::string probability_text(double probability) {
  if (!std::isfinite(probability)) return number_text(probability);
  std::string digits = number_text(probability, std::chars_format::fixed);
  std::size_t point = digits.find('.');
  if (point == std::string::npos) point = digits.size();
  digits.erase(point, 1);
  digits.resize(std::max(digits.size(), point + 2), '0');
  std::string decimals = digits.substr(point + 2);
  decimals.erase(decimals.find_last_not_of('0') + 1);
  std::string whole = digits.substr(0, point + 2);
  const std::string sign = whole.front() == '-' ? "-" : "";
  whole.erase(0, std::min(whole.find_first_not_of("-0"), whole.size() - 1));
  return sign + whole + (decimals.empty() ? "" : "." + decimals) + "%";
}

std::string number_text(double value) { return number_text(value, std::chars_format::general); }

std::optional<std::uint64_t> parse_whole(std::string_view text) {
  std::uint64_t value = 0;
  const bool hexadecimal = text.starts_with("0x");
  if (hexadecimal) text.remove_prefix(2);
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, hexadecimal ? 16 : 10);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

}  // namespace tendon::injector
