// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <type_traits>

namespace tendon {

/// Unsigned integers in little-endian byte order, for the wire, MCAP and hashes. Realtime-safe.

template <std::unsigned_integral T>
constexpr void put_little_endian(T value, std::byte* to) noexcept {
  if (!std::is_constant_evaluated() && std::endian::native == std::endian::little) {
    std::memcpy(to, &value, sizeof value);  // this is a single store, which is not generated for the loop
    return;
  }
  for (std::size_t i = 0; i < sizeof(T); ++i) to[i] = static_cast<std::byte>(value >> (8 * i) & 0xFFU);
}

template <std::unsigned_integral T>
constexpr T get_little_endian(const std::byte* from) noexcept {
  T value = 0;
  if (!std::is_constant_evaluated() && std::endian::native == std::endian::little) {
    std::memcpy(&value, from, sizeof value);
    return value;
  }
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(value | static_cast<T>(std::to_integer<T>(from[i]) << (8 * i)));
  }
  return value;
}

template <std::unsigned_integral T>
constexpr std::array<std::byte, sizeof(T)> little_endian(T value) noexcept {
  std::array<std::byte, sizeof(T)> bytes{};
  put_little_endian(value, bytes.data());
  return bytes;
}

}  // namespace tendon
