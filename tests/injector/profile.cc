// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/profile.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>

namespace tendon::injector {
namespace {

constexpr std::string_view kBlanks = " \t\r";

/// The whole of `text` as a finite number.
std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// The shortest text that reads back as exactly `value`.
std::string number_text(double value, std::chars_format format = std::chars_format::general) {
  std::array<char, 512> text{};  // the smallest double takes 327 characters in fixed notation
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value, format);
  return {text.data(), end};
}

/// `value` units of `unit_ns` each, to the nearest nanosecond.
std::optional<Duration> to_duration(double value, double unit_ns) {
  const double ns = value * unit_ns;
  // Beyond a day it would not be a delay, and beyond 2⁶³ ns not an integer.
  if (std::abs(ns) > 86'400e9) return std::nullopt;
  return Duration(static_cast<std::int64_t>(ns + (ns < 0 ? -0.5 : 0.5)));
}

std::optional<Duration> parse_duration(std::string_view text) {
  struct Unit {
    std::string_view name;
    double ns;
  };
  // "s" is last: the other names end with it.
  constexpr std::array<Unit, 4> kUnits = {Unit{"ns", 1}, Unit{"us", 1e3}, Unit{"ms", 1e6}, Unit{"s", 1e9}};
  for (const Unit& unit : kUnits) {
    if (!text.ends_with(unit.name)) continue;
    const std::optional<double> value = parse_number(text.substr(0, text.size() - unit.name.size()));
    return value ? to_duration(*value, unit.ns) : std::nullopt;
  }
  return std::nullopt;
}

/// In ms with as many decimals as there are nanoseconds: exact.
std::string duration_text(Duration duration) {
  const std::int64_t ns = std::abs(duration.count());
  std::string text = (duration.count() < 0 ? "-" : "") + std::to_string(ns / 1'000'000);
  if (ns % 1'000'000 != 0) {
    std::string decimals = std::to_string(1'000'000 + ns % 1'000'000).substr(1);
    decimals.erase(decimals.find_last_not_of('0') + 1);
    text += "." + decimals;
  }
  return text + "ms";
}

std::optional<double> parse_probability(std::string_view text) {
  if (!text.ends_with('%')) return parse_number(text);
  text.remove_suffix(1);
  if (text.find_first_not_of("-0123456789.") != std::string_view::npos) return std::nullopt;
  // Moves the decimal point in the text, not in the number: 7% is then exactly the double 0.07.
  return parse_number(std::string(text) + "e-2");
}

/// In percent, by moving the decimal point in the text: exact.
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

[[noreturn]] void refuse(std::string_view field, std::string_view value, std::string_view expected) {
  throw std::invalid_argument(std::string(field) + " is " + std::string(value) + ", expected " + std::string(expected));
}

constexpr std::string_view kDurationForm = "a number with its unit like 20ms (ns, us, ms or s)";
constexpr std::string_view kProbabilityForm = "a probability like 2% or 0.02";

void check_duration(std::string_view field, Duration value) {
  if (value < Duration::zero() || value > kMaxDelay) {
    refuse(field, duration_text(value), "0ms to " + duration_text(kMaxDelay));
  }
}

void check_probability(std::string_view field, double value) {
  if (!(value >= 0 && value <= 1)) refuse(field, probability_text(value), "a probability from 0% to 100%");
}

/// What is wrong with `bin`, which follows `previous`, if anything.
std::optional<std::string> complaint(const Profile::Bin* previous, const Profile::Bin& bin) {
  if (bin.lower < Duration::zero() || bin.lower > kMaxDelay) {
    return "lower edge is " + duration_text(bin.lower) + ", expected 0ms to " + duration_text(kMaxDelay);
  }
  if (previous != nullptr && bin.lower <= previous->lower) {
    return "lower edge is " + duration_text(bin.lower) + ", expected more than " + duration_text(previous->lower) +
           " of the bin before it";
  }
  if (!(std::isfinite(bin.weight) && bin.weight >= 0)) {
    return "weight is " + number_text(bin.weight) + ", expected a number that is zero or more";
  }
  return std::nullopt;
}

double total_weight(const std::vector<Profile::Bin>& bins) {
  double total = 0;
  for (const Profile::Bin& bin : bins) total += bin.weight;
  return total;
}

/// What is wrong with the sum of the weights, if anything.
std::optional<std::string> complaint(double total) {
  if (std::isfinite(total) && total > 0) return std::nullopt;
  return "the sum of all weights is " + number_text(total) + ", expected a finite number above zero";
}

/// The text up to the first of `separators`, taken off `rest` together with the separator.
std::string_view take_until(std::string_view& rest, std::string_view separators) {
  const std::size_t end = std::min(rest.find_first_of(separators), rest.size());
  const std::string_view taken = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return taken;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<Profile::Bin> parse_histogram(std::string_view text) {
  std::vector<Profile::Bin> bins;
  while (!text.empty()) {
    std::string_view rest = take_until(text, ",");
    const std::string_view bin = rest;
    const std::optional<Duration> lower = parse_duration(take_until(rest, ":"));
    const std::optional<double> weight = parse_number(rest);
    if (!lower || !weight) refuse("histogram", bin, "bins as LOWER_EDGE:WEIGHT like 0.56ms:72,0.59ms:5058");
    bins.push_back({*lower, *weight});
  }
  return bins;
}

std::string in_quotes(std::string_view text) { return "\"" + std::string(text) + "\""; }

}  // namespace

void check(const Profile& profile) {
  check_duration("delay", profile.delay);
  check_duration("jitter", profile.jitter);
  check_probability("loss", profile.loss);
  check_probability("duplicate", profile.duplicate);
  if (profile.histogram.empty()) return;

  if (profile.jitter != Duration::zero()) {
    refuse("jitter", duration_text(profile.jitter),
           "0ms together with a histogram, which already says how delays vary");
  }
  if (profile.histogram.size() > kMaxBins) {
    refuse("histogram", std::to_string(profile.histogram.size()) + " bins", "at most " + std::to_string(kMaxBins));
  }
  const Profile::Bin* previous = nullptr;
  for (const Profile::Bin& bin : profile.histogram) {
    if (const auto wrong = complaint(previous, bin)) {
      throw std::invalid_argument("histogram bin " + std::to_string(&bin - profile.histogram.data()) + ": " + *wrong);
    }
    previous = &bin;
  }
  if (const auto wrong = complaint(total_weight(profile.histogram)))
    throw std::invalid_argument("histogram: " + *wrong);
}

std::string to_string(const Profile& profile) {
  std::string line = "delay=" + duration_text(profile.delay);
  if (profile.jitter != Duration::zero()) line += " jitter=" + duration_text(profile.jitter);
  if (profile.loss != 0) line += " loss=" + probability_text(profile.loss);
  if (profile.duplicate != 0) line += " duplicate=" + probability_text(profile.duplicate);
  std::string_view separator = " histogram=";
  for (const Profile::Bin& bin : profile.histogram) {
    line.append(separator).append(duration_text(bin.lower) + ":" + number_text(bin.weight));
    separator = ",";
  }
  return line;
}

Profile parse_profile(std::string_view line) {
  Profile profile;
  std::vector<std::string_view> seen;
  while (!(line = trimmed(line)).empty()) {
    std::string_view value = take_until(line, kBlanks);
    const std::string_view field = take_until(value, "=");
    for (const std::string_view other : seen) {
      if (other == field) throw std::invalid_argument(std::string(field) + " is given twice, expected once");
    }
    seen.push_back(field);

    if (field == "delay" || field == "jitter") {
      const std::optional<Duration> duration = parse_duration(value);
      if (!duration) refuse(field, in_quotes(value), kDurationForm);
      (field == "delay" ? profile.delay : profile.jitter) = *duration;
    } else if (field == "loss" || field == "duplicate") {
      const std::optional<double> probability = parse_probability(value);
      if (!probability) refuse(field, in_quotes(value), kProbabilityForm);
      (field == "loss" ? profile.loss : profile.duplicate) = *probability;
    } else if (field == "histogram") {
      profile.histogram = parse_histogram(value);
    } else {
      refuse("a field of the profile", in_quotes(field), "delay, jitter, loss, duplicate or histogram");
    }
  }
  check(profile);
  return profile;
}

std::vector<Profile::Bin> histogram_from_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  // A directory opens, and fails only when it is read.
  if (!in || in.peek() == std::ifstream::traits_type::eof()) {
    throw std::invalid_argument(file.string() + ": cannot be read or is empty, expected a histogram as CSV");
  }
  std::vector<Profile::Bin> bins;
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    const auto refuse_line = [&](const std::string& why) {
      throw std::invalid_argument(file.string() + ":" + std::to_string(number) + ": " + why);
    };
    std::string_view rest = trimmed(std::string_view(text).substr(0, text.find('#')));
    if (rest.empty()) continue;
    const std::string line(rest);

    const std::optional<double> edge_ms = parse_number(take_until(rest, ",; \t"));
    rest = trimmed(rest);
    if (rest.starts_with(',') || rest.starts_with(';')) rest = trimmed(rest.substr(1));
    const std::optional<double> weight = parse_number(rest);
    if (!edge_ms || !weight) refuse_line("expected LOWER_EDGE_MS,COUNT like 0.56,72, got " + in_quotes(line));
    const std::optional<Duration> lower = to_duration(*edge_ms, 1e6);
    if (!lower)
      refuse_line("lower edge is " + number_text(*edge_ms) + "ms, expected 0ms to " + duration_text(kMaxDelay));

    const Profile::Bin bin{*lower, *weight};
    if (const auto wrong = complaint(bins.empty() ? nullptr : &bins.back(), bin)) refuse_line(*wrong);
    if (bins.size() == kMaxBins) refuse_line("expected at most " + std::to_string(kMaxBins) + " bins");
    bins.push_back(bin);
  }
  if (const auto wrong = complaint(total_weight(bins))) throw std::invalid_argument(file.string() + ": " + *wrong);
  return bins;
}

}  // namespace tendon::injector
