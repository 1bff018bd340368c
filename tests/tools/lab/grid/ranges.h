// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tendon::lab {

/// Replaces the ranges and lists of a text by their values: `delay=0:40:20ms loss={0,1}%` becomes `delay=0ms loss=0%`,
/// `delay=0ms loss=1%`, `delay=20ms loss=0%` … A range A:B:STEP includes both ends. The last range or list varies
/// fastest. A text without any is returned as it is.
///
/// Throws std::invalid_argument if a list is empty or not closed, a range does not reach its end in whole steps, or the
/// result has more than kMostValues texts.
std::vector<std::string> expanded(std::string_view text);

/// Parses numbers separated by commas, each of which can be a range or list, and which must be in [least, most]. Throws
/// std::invalid_argument that begins with `option`, also if a number occurs twice.
std::vector<double> numbers(std::string_view text, std::string_view option, double least, double most);

/// Splits at each comma outside of brackets.
std::vector<std::string> separated(std::string_view text);

inline constexpr std::size_t kMostValues = 100'000;

}  // namespace tendon::lab
