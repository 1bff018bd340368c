// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tendon {

/// One line, with members in the order of their addition. Non-finite numbers become null; invalid UTF-8 becomes U+FFFD.
/// Only json_line.cc includes nlohmann's header.
class JsonLine {
 public:
  JsonLine();
  ~JsonLine();
  JsonLine(JsonLine&&) noexcept;
  JsonLine& operator=(JsonLine&&) noexcept;

  JsonLine& add(std::string_view key, std::string_view text);
  JsonLine& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  JsonLine& add(std::string_view key, const std::string& text) { return add(key, std::string_view(text)); }
  JsonLine& add(std::string_view key, bool value);
  JsonLine& add(std::string_view key, double value);
  template <std::signed_integral T>
  JsonLine& add(std::string_view key, T value) {
    return add_signed(key, value);
  }
  template <std::unsigned_integral T>
  JsonLine& add(std::string_view key, T value) {
    return add_unsigned(key, value);
  }
  JsonLine& add(std::string_view key, const JsonLine& object);
  JsonLine& add(std::string_view key, const std::vector<std::string>& texts);
  template <class T>
  JsonLine& add(std::string_view key, const std::optional<T>& value) {
    return value ? add(key, *value) : add_null(key);
  }
  JsonLine& add_all(const JsonLine& other);

  std::string str() const;

 private:
  JsonLine& add_signed(std::string_view key, std::int64_t value);
  JsonLine& add_unsigned(std::string_view key, std::uint64_t value);
  JsonLine& add_null(std::string_view key);

  std::unique_ptr<nlohmann::ordered_json> members_;
};

double with_decimals(double value, int decimals);

}  // namespace tendon
