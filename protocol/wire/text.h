// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// Functions for untrusted text.

namespace tendon {

/// Returns the size of the first UTF-8 character, or 0 if it is invalid. Does not accept overlong forms, surrogates, or
/// values above U+10FFFF (RFC 3629; table 3-7 of the Unicode standard).
std::size_t utf8_character(std::string_view text) noexcept;

/// Returns the longest valid UTF-8 prefix with at most `limit` bytes. Protobuf parsers reject a message if a text is
/// not UTF-8.
std::string_view clipped(std::string_view text, std::size_t limit) noexcept;
std::string clip(std::string_view text, std::size_t limit);

/// Escapes control characters (C0, DEL, C1) and invalid UTF-8 as \n, \t or \xNN, so that `text` cannot start a new line
/// or move the cursor in a log, a terminal or a page.
std::string visible(std::string_view text);

}  // namespace tendon
