// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::dash {

/// Writes JSON (RFC 8259) into a text: commas, quotes and escapes are its business, the order of the calls is the
/// caller's.
///
///     JsonWriter json;
///     json.begin_object().key("name").value("left").key("at").begin_array().value(1.5).end_array().end_object();
///     json.text()                                                  {"name":"left","at":[1.5]}
///
/// Numbers are the shortest that read back as the same; what JSON has no number for (NaN, infinities) is null.
///
/// Thread-safe: no. Realtime-safe: no.
class JsonWriter {
 public:
  JsonWriter& begin_object() { return open('{'); }
  JsonWriter& end_object() { return close('}'); }
  JsonWriter& begin_array() { return open('['); }
  JsonWriter& end_array() { return close(']'); }
  JsonWriter& key(std::string_view name);

  /// `text` is UTF-8; bytes that are none become U+FFFD.
  JsonWriter& value(std::string_view text);
  JsonWriter& value(const char* text) { return value(std::string_view(text)); }
  JsonWriter& value(double number);
  /// Seven digits: what a plot shows.
  JsonWriter& value(float number);
  JsonWriter& value(bool truth);
  template <std::unsigned_integral T>
  JsonWriter& value(T number) requires(!std::same_as<T, bool>) {
    return put(std::to_string(number));
  }
  JsonWriter& null() { return put("null"); }

  const std::string& text() const noexcept { return text_; }
  std::string take() { return std::move(text_); }

 private:
  JsonWriter& open(char bracket);
  JsonWriter& close(char bracket);
  JsonWriter& put(std::string_view raw);
  void comma();

  std::string text_;
  bool first_ = true;  ///< nothing has been written on this level since its bracket, or since a key
};

/// True when `text` is UTF-8 (RFC 3629: no overlong form, no surrogate) without control characters.
bool is_plain_text(std::string_view text) noexcept;

}  // namespace tendon::dash
