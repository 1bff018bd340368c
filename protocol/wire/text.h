// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// Texts that strangers send and read. Protobuf parsers refuse a whole datagram for one character that is not UTF-8.

namespace tendon {

/// Bytes of the UTF-8 character at the front of `text`; 0 when there is none. RFC 3629 (table 3-7 of the Unicode
/// standard): no overlong forms, no surrogates, nothing above U+10FFFF.
std::size_t utf8_character(std::string_view text) noexcept;

/// The longest front of `text` that is UTF-8 and has at most `limit` bytes.
std::string_view clipped(std::string_view text, std::size_t limit) noexcept;
std::string clip(std::string_view text, std::size_t limit);

/// Escapes `text` for a log, a terminal or a page, so that it cannot start a line or move the cursor. Control characters
/// (C0, DEL, C1) and bytes that are not UTF-8 become \n, \t or \xNN. All other characters stay the same.
std::string visible(std::string_view text);

}  // namespace tendon
