// SPDX-License-Identifier: Apache-2.0
#include "tests/support/json_line.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace tendon {

using nlohmann::ordered_json;

JsonLine::JsonLine() : members_(std::make_unique<ordered_json>(ordered_json::object())) {}
JsonLine::~JsonLine() = default;
JsonLine::JsonLine(JsonLine&&) noexcept = default;
JsonLine& JsonLine::operator=(JsonLine&&) noexcept = default;

namespace {

template <class T>
void put(ordered_json& members, std::string_view key, T&& value) {
  members[std::string(key)] = std::forward<T>(value);
}

}  // namespace

JsonLine& JsonLine::add(std::string_view key, std::string_view text) { return put(*members_, key, text), *this; }
JsonLine& JsonLine::add(std::string_view key, bool value) { return put(*members_, key, value), *this; }
JsonLine& JsonLine::add(std::string_view key, double value) { return put(*members_, key, value), *this; }
JsonLine& JsonLine::add(std::string_view key, const JsonLine& object) {
  return put(*members_, key, *object.members_), *this;
}
JsonLine& JsonLine::add(std::string_view key, const std::vector<std::string>& texts) {
  return put(*members_, key, texts), *this;
}
JsonLine& JsonLine::add_all(const JsonLine& other) {
  for (const auto& [key, value] : other.members_->items()) put(*members_, key, value);
  return *this;
}
JsonLine& JsonLine::add_signed(std::string_view key, std::int64_t value) { return put(*members_, key, value), *this; }
JsonLine& JsonLine::add_unsigned(std::string_view key, std::uint64_t value) {
  return put(*members_, key, value), *this;
}
JsonLine& JsonLine::add_null(std::string_view key) { return put(*members_, key, nullptr), *this; }

std::string JsonLine::str() const { return members_->dump(-1, ' ', false, ordered_json::error_handler_t::replace); }

double with_decimals(double value, int decimals) {
  double scale = 1;
  for (int i = 0; i < decimals; ++i) scale *= 10;
  return std::round(value * scale) / scale;
}

}  // namespace tendon
