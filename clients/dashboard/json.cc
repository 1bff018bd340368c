// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/json.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

namespace tendon::dash {
namespace {

template <class T>
std::string_view shortest(T number, std::array<char, 32>& buffer) {
  if (!std::isfinite(number)) return "null";
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr;
  return {buffer.data(), static_cast<std::size_t>(end - buffer.data())};
}

/// Bytes of the character at the front of `text`; 0 when that is no UTF-8.
std::size_t character(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < size) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
  }
  // Overlong, a surrogate, or beyond U+10FFFF.
  const unsigned char second = byte(1);
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) || (first == 0xF0 && second < 0x90) ||
      (first == 0xF4 && second > 0x8F)) {
    return 0;
  }
  return size;
}

}  // namespace

bool is_plain_text(std::string_view text) noexcept {
  while (!text.empty()) {
    const std::size_t size = character(text);
    if (size == 0 || static_cast<unsigned char>(text[0]) < 0x20 || text[0] == 0x7F) return false;
    text.remove_prefix(size);
  }
  return true;
}

JsonWriter& JsonWriter::key(std::string_view name) {
  value(name);
  text_ += ':';
  first_ = true;
  return *this;
}

JsonWriter& JsonWriter::value(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  comma();
  text_ += '"';
  while (!text.empty()) {
    const std::size_t size = character(text);
    const char c = text[0];
    if (size == 0) {
      text_ += "\xEF\xBF\xBD";
    } else if (c == '"' || c == '\\') {
      text_ += '\\';
      text_ += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      text_ += "\\u00";
      text_ += kHex[static_cast<unsigned char>(c) >> 4U];
      text_ += kHex[static_cast<unsigned char>(c) & 0xFU];
    } else {
      text_ += text.substr(0, size);
    }
    text.remove_prefix(size == 0 ? 1 : size);
  }
  text_ += '"';
  return *this;
}

JsonWriter& JsonWriter::value(double number) {
  std::array<char, 32> buffer;
  return put(shortest(number, buffer));
}

JsonWriter& JsonWriter::value(float number) {
  std::array<char, 32> buffer;
  return put(shortest(number, buffer));
}

JsonWriter& JsonWriter::value(bool truth) { return put(truth ? "true" : "false"); }

JsonWriter& JsonWriter::open(char bracket) {
  comma();
  text_ += bracket;
  first_ = true;
  return *this;
}

JsonWriter& JsonWriter::close(char bracket) {
  text_ += bracket;
  first_ = false;
  return *this;
}

JsonWriter& JsonWriter::put(std::string_view raw) {
  comma();
  text_ += raw;
  return *this;
}

void JsonWriter::comma() {
  if (!first_) text_ += ',';
  first_ = false;
}

}  // namespace tendon::dash
