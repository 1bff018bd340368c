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

/// Returns the longest valid UTF-8 prefix of at most `limit` bytes. Protobuf parsers reject other texts.
std::string_view clipped(std::string_view text, std::size_t limit) noexcept;
std::string clip(std::string_view text, std::size_t limit);

/// Escapes control characters (C0, DEL, C1) and invalid UTF-8 as \n, \t or \xNN, to keep `text` on its line in a log.
std::string visible(std::string_view text);

}  // namespace tendon
