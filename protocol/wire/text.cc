// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/text.h"

#include <algorithm>

namespace tendon {

std::size_t utf8_character(std::string_view text) noexcept {
  const auto at = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
  };
  const auto follows = [&](std::size_t i) { return (at(i) & 0xC0U) == 0x80U; };
  const unsigned first = at(0);
  if (text.empty()) return 0;
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const bool overlong = first == 0xE0 && at(1) < 0xA0;
    const bool surrogate = first == 0xED && at(1) > 0x9F;
    return follows(1) && follows(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool overlong = first == 0xF0 && at(1) < 0x90;
    const bool too_high = first == 0xF4 && at(1) > 0x8F;
    return follows(1) && follows(2) && follows(3) && !overlong && !too_high ? 4 : 0;
  }
  return 0;
}

std::string visible(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  while (!text.empty()) {
    const std::size_t size = utf8_character(text);
    const auto first = static_cast<unsigned char>(text.front());
    const bool c1 = size == 2 && first == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0;
    if (size > 0 && !c1 && first >= ' ' && first != 0x7F) {
      out += text.substr(0, size);
    } else if (first == '\n' || first == '\t') {
      out += first == '\n' ? "\\n" : "\\t";
    } else {
      const auto code = c1 ? static_cast<unsigned char>(text[1]) : first;
      out += {'\\', 'x', kDigits[code >> 4U], kDigits[code & 0xFU]};
    }
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return out;
}

std::string_view clipped(std::string_view text, std::size_t limit) noexcept {
  std::size_t size = 0;
  while (size < text.size()) {
    const std::size_t next = utf8_character(text.substr(size));
    if (next == 0 || size + next > limit) break;
    size += next;
  }
  return text.substr(0, size);
}

std::string clip(std::string_view text, std::size_t limit) { return std::string(clipped(text, limit)); }

}  // namespace tendon
