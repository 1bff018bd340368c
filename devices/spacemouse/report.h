// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

/// HID input reports of a 3Dconnexion SpaceMouse: an id and little-endian integers. There is no official documentation;
/// source: free drivers (spacenavd, users of hidapi).
///
///     id 1    X Y Z (7 bytes), or X Y Z Rx Ry Rz (13 bytes): int16 each, ±350 at the stops
///     id 2    Rx Ry Rz (7 bytes): older devices, in addition to id 1 with 7 bytes
///     id 3    buttons, one bit each
///     id 23   battery of a wireless device
namespace tendon::spacemouse {

using Axes = std::array<std::int16_t, 3>;  ///< raw: X to the right, Y towards the user, Z down

inline constexpr double kFullDeflection = 350;  ///< at the stops; some devices exceed this slightly

struct Motion {
  std::optional<Axes> translation{};
  std::optional<Axes> rotation{};
};
struct Buttons {
  std::uint32_t held = 0;  ///< at most 32
};
struct Battery {
  std::uint8_t percent = 0;  ///< 0 to 100
};
using Report = std::variant<Motion, Buttons, Battery>;

/// Returns nullopt if the id is unknown or its length is wrong. Thread-safe, realtime-safe.
std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace tendon::spacemouse
