// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

/// The HID input reports of a 3Dconnexion SpaceMouse: a number (the id) and the fields, integers least byte first.
/// Source: free drivers (spacenavd, users of hidapi); the maker documents nothing.
///
///     id 1    X Y Z (7 bytes), or X Y Z Rx Ry Rz (13 bytes): int16 each, ±350 at the stops
///     id 2    Rx Ry Rz (7 bytes): older devices, beside a 1 of 7 bytes
///     id 3    buttons, one bit each
///     id 23   the battery of a wireless one
namespace tendon::spacemouse {

/// Raw, of the cap: X to the right, Y towards the user, Z down.
using Axes = std::array<std::int16_t, 3>;

/// At the stops; some devices say a little more.
inline constexpr double kFullDeflection = 350;

struct Motion {
  std::optional<Axes> translation{};
  std::optional<Axes> rotation{};
};
struct Buttons {
  std::uint32_t held = 0;  ///< the first 32 of them
};
struct Battery {
  std::uint8_t percent = 0;  ///< its first byte, 0 to 100
};
using Report = std::variant<Motion, Buttons, Battery>;

/// The report in these bytes; the first is its id. Empty for an id that is not above, and for a length that its id does
/// not have. Thread-safe, realtime-safe.
std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace tendon::spacemouse
