// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tendon {

/// Returns the known word with the smallest edit distance to a misspelled word. Swapping two adjacent letters counts as
/// one edit. Returns an empty view if more than a third of the letters are different, or if `unknown` is longer than 64
/// characters.
std::string_view nearest_word(std::string_view unknown, const std::vector<std::string_view>& known);

/// Returns "; did you mean WORD?" for use in an error message, or an empty string if no known word is close.
std::string did_you_mean(std::string_view unknown, const std::vector<std::string_view>& known);
/// Same as above, but `known` is a comma-separated list such as "aol, aol+, none".
std::string did_you_mean(std::string_view unknown, std::string_view known);

/// Returns " (a decimal point?)" if `text` contains a comma between two digits, and an empty text otherwise. An error
/// message about a number can end with this.
std::string_view decimal_point_hint(std::string_view text) noexcept;

}  // namespace tendon
