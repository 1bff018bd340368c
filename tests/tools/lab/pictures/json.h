// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

namespace tendon::lab {

/// One JSON object on one line, built in the order in which its members are added. Numbers are as short as they can be
/// read back exactly; what is not finite is null.
class JsonLine {
 public:
  JsonLine& add(std::string_view key, std::string_view text) { return raw(key, quoted(text)); }
  JsonLine& add(std::string_view key, const char* text) { return raw(key, quoted(text)); }
  JsonLine& add(std::string_view key, bool value) { return raw(key, value ? "true" : "false"); }
  JsonLine& add(std::string_view key, std::integral auto value) { return raw(key, std::to_string(value)); }
  JsonLine& add(std::string_view key, double value) { return raw(key, number(value)); }
  template <class T>
  JsonLine& add(std::string_view key, const std::optional<T>& value) {
    return value ? add(key, *value) : raw(key, "null");
  }

  std::string str() const { return "{" + members_ + "}"; }

  static std::string number(double value) {
    if (!std::isfinite(value)) return "null";
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
  }

  static std::string quoted(std::string_view text) {
    constexpr std::string_view kHex = "0123456789abcdef";
    std::string result = "\"";
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') {
        result += '\\';
        result += c;
      } else if (byte < 0x20) {
        result += "\\u00";
        result += kHex[byte / 16];
        result += kHex[byte % 16];
      } else {
        result += c;
      }
    }
    return result + "\"";
  }

 private:
  JsonLine& raw(std::string_view key, std::string_view value) {
    if (!members_.empty()) members_ += ',';
    members_ += quoted(key);
    members_ += ':';
    members_ += value;
    return *this;
  }

  std::string members_;
};

}  // namespace tendon::lab
