// SPDX-License-Identifier: Apache-2.0
#pragma once

// This file defines the functions that are missing in the standard library of emscripten 3.1.6 (Debian 12). It is only
// used by clients/playground, which includes it at the beginning of each source.
#include <version>
#if !defined(__EMSCRIPTEN__) || (defined(__cpp_lib_ranges) && defined(__cpp_lib_to_chars))
#error "this compiler has its own standard library: remove emscripten_std.h from clients/playground/CMakeLists.txt"
#endif

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <string>

namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}

/// Writes the shortest text that is parsed as `value`. By default, this is fixed or scientific notation.
inline to_chars_result to_chars(char* first, char* last, double value, chars_format format = chars_format{}) {
  char text[512];
  int digits = 0;
  do {
    snprintf(text, sizeof text, "%.*e", digits, value);
  } while (strtod(text, nullptr) != value && ++digits < 17 && value == value);
  string best = text;
  if (const auto e = best.find('e'); e != string::npos && format != chars_format::scientific) {
    const int exponent = atoi(text + e + 1);
    const string fixed(text,
                       static_cast<size_t>(snprintf(text, sizeof text, "%.*f", max(0, digits - exponent), value)));
    if (format == chars_format::fixed || fixed.size() <= best.size()) best = fixed;
  }
  if (last - first < static_cast<ptrdiff_t>(best.size())) return {last, errc::value_too_large};
  return {copy(best.begin(), best.end(), first), errc{}};
}

inline to_chars_result to_chars(char* first, char* last, double value, chars_format /*general*/, int precision) {
  const int size = snprintf(first, static_cast<size_t>(last - first), "%.*g", precision, value);
  if (size >= last - first) return {last, errc::value_too_large};
  return {first + size, errc{}};
}

inline from_chars_result from_chars(const char* first, const char* last, double& value) {
  const string text(first, last);
  char* end = nullptr;
  if (text.empty() || text[0] == ' ' || text[0] == '+') return {first, errc::invalid_argument};
  value = strtod(text.c_str(), &end);
  if (end == text.c_str()) return {first, errc::invalid_argument};
  return {first + (end - text.c_str()), errc{}};
}

namespace ranges {

template <class Range, class T, class Projection = identity>
constexpr auto find(Range&& range, const T& value, Projection projection = {}) {
  return std::find_if(begin(range), end(range), [&](const auto& item) { return invoke(projection, item) == value; });
}
template <class Range, class Holds>
constexpr auto find_if(Range&& range, Holds holds) {
  return std::find_if(begin(range), end(range), holds);
}
template <class Range, class Holds>
constexpr bool any_of(Range&& range, Holds holds) {
  return std::any_of(begin(range), end(range), holds);
}
template <class Range>
constexpr bool is_sorted(Range&& range) {
  return std::is_sorted(begin(range), end(range));
}
template <class Range, class T>
constexpr auto lower_bound(Range&& range, const T& value) {
  return std::lower_bound(begin(range), end(range), value);
}

}  // namespace ranges
}  // namespace std
