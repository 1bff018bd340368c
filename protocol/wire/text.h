// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// Texts from and for untrusted peers. A protobuf parser rejects a whole datagram because of one character that is not
// UTF-8.

namespace tendon {

/// Returns the number of bytes of the UTF-8 character at the start of `text`, or 0 if there is none. Follows RFC 3629
/// (table 3-7 of the Unicode standard): no overlong forms, no surrogates, nothing above U+10FFFF.
std::size_t utf8_character(std::string_view text) noexcept;

/// Returns the longest prefix of `text` that is valid UTF-8 and has at most `limit` bytes.
std::string_view clipped(std::string_view text, std::size_t limit) noexcept;
std::string clip(std::string_view text, std::size_t limit);

/// Escapes `text` for a log, a terminal or a page, so that it cannot start a new line or move the cursor. Control
/// characters (C0, DEL, C1) and bytes that are not UTF-8 become \n, \t or \xNN.
std::string visible(std::string_view text);

}  // namespace tendon
