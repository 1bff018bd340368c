// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/words.h"

#include <algorithm>
#include <stdexcept>

namespace tendon::injector {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string_view take_until(std::string_view& rest, std::string_view separators) {
  int depth = 0;
  std::size_t end = 0;
  for (; end < rest.size(); ++end) {
    if (depth <= 0 && separators.find(rest[end]) != std::string_view::npos) break;
    depth += rest[end] == '(' ? 1 : rest[end] == ')' ? -1 : 0;
  }
  const std::string_view taken = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return taken;
}

std::string in_quotes(std::string_view text) { return "\"" + std::string(text) + "\""; }

std::string hexadecimal(std::uint8_t byte) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  return {'0', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
}

void refuse(const std::string& field, const std::string& value, const std::string& expected) {
  throw std::invalid_argument(field + " is " + value + ", expected " + expected);
}

}  // namespace tendon::injector
