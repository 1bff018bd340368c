// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

/// Reads the short text files of proc and sys. Missing or damaged files are empty.
namespace tendon::kernel_files {

inline std::string without_space_at_end(std::string text) {
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  return text;
}

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return without_space_at_end(std::string(std::istreambuf_iterator<char>(stream), {}));
}

inline std::optional<std::int64_t> number_of(std::string_view text, int base = 10) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// The first word after `start` in the first line that begins with it.
inline std::string value_after(const std::string& text, std::string_view start) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(start)) continue;
    std::istringstream rest(line.substr(start.size()));
    std::string value;
    rest >> value;
    return value;
  }
  return {};
}

using Processors = std::set<std::int64_t>;

/// More than any kernel supports; bounds the size of a set.
inline constexpr std::int64_t kMostProcessors = 65536;

/// Returns {0, 1, 2, 3, 5} for "0-3,5", and an empty set for everything else, such as "" and "(null)".
inline Processors processors_of(const std::string& list) {
  Processors all;
  std::istringstream ranges(list);
  for (std::string range; std::getline(ranges, range, ',');) {
    const auto dash = range.find('-');
    const auto first = number_of(range.substr(0, dash));
    const auto last = dash == std::string::npos ? first : number_of(range.substr(dash + 1));
    if (!first || !last || *first < 0 || *last >= kMostProcessors) return {};
    for (std::int64_t one = *first; one <= *last; ++one) all.insert(one);
  }
  return all;
}

/// The inverse of processors_of.
inline std::string list_of(const Processors& all) {
  std::string text;
  for (auto one = all.begin(); one != all.end(); ++one) {
    const std::int64_t first = *one;
    std::int64_t last = first;
    while (std::next(one) != all.end() && *std::next(one) == last + 1) last = *++one;
    text += (text.empty() ? "" : ",") + std::to_string(first);
    if (last > first) text += "-" + std::to_string(last);
  }
  return text;
}

}  // namespace tendon::kernel_files
