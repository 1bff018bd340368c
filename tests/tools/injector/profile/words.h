// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tendon::injector {

inline constexpr std::string_view kBlanks = " \t\r\n";

std::string_view trimmed(std::string_view text);

/// Removes and returns the text up to the first of `separators` outside brackets; also removes the separator.
std::string_view take_until(std::string_view& rest, std::string_view separators);

std::string in_quotes(std::string_view text);

std::string hexadecimal(std::uint8_t byte);

/// Throws std::invalid_argument "FIELD is VALUE, expected EXPECTED".
[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& expected);

}  // namespace tendon::injector
