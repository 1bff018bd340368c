// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace tendon {

/// Removes the UTF-8 byte order mark that some Windows programs write. Must be called for all text files from users.
constexpr std::string_view without_byte_order_mark(std::string_view text) noexcept {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

}  // namespace tendon
