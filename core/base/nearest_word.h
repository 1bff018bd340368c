// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tendon {

/// Returns the known word with the smallest edit distance to `unknown`, where swapping two adjacent letters is one
/// edit. Returns an empty view if more than a third of the letters differ or `unknown` has more than 64 letters.
std::string_view nearest_word(std::string_view unknown, const std::vector<std::string_view>& known);

/// Returns "; did you mean WORD?" for an error message, or an empty string if no known word is close.
std::string did_you_mean(std::string_view unknown, const std::vector<std::string_view>& known);
/// `known` is a comma-separated list such as "aol, aol+, none".
std::string did_you_mean(std::string_view unknown, std::string_view known);

/// Returns " (a decimal point?)" for an error message if `text` has a comma between two digits, or an empty view.
std::string_view decimal_point_hint(std::string_view text) noexcept;

}  // namespace tendon
