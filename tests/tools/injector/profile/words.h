// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tendon::injector {

// How the text of a profile is taken to pieces, and how a complaint about it is worded.

inline constexpr std::string_view kBlanks = " \t\r\n";

/// `text` without the blanks around it.
std::string_view trimmed(std::string_view text);

/// The text up to the first of `separators` outside brackets, taken off `rest` together with the separator.
std::string_view take_until(std::string_view& rest, std::string_view separators);

std::string in_quotes(std::string_view text);

/// "0x0f".
std::string hexadecimal(std::uint8_t byte);

/// Throws std::invalid_argument "FIELD is VALUE, expected EXPECTED".
[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& expected);

}  // namespace tendon::injector
