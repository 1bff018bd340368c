// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "core/base/time.h"

// What a device shows or does beside its forces: lamps, and vibration by something else than the motors of the
// position. No energy ledger counts it.

namespace tendon {

/// Of one device.
inline constexpr std::size_t kMostOutputs = 8;

/// Part of the wire: never renumber.
enum class OutputKind : std::uint8_t { kLamp = 1, kVibration = 2 };

/// One of them.
struct OutputDescription {
  std::string name;  ///< at most 24 bytes
  OutputKind kind = OutputKind::kLamp;

  bool operator==(const OutputDescription&) const = default;
};

/// The colour of a lamp; 0 = off: it shows what the device itself shows.
struct LampColour {
  std::uint32_t rgb = 0;  ///< 0xRRGGBB

  bool operator==(const LampColour&) const = default;
};

/// A pulse, as OpenXR's XrHapticVibration: it ends by itself, and another one takes its place at once.
struct Vibration {
  double amplitude = 0;  ///< [0, 1] of the strongest that the output can; 0 = off
  double frequency = 0;  ///< Hz, 20 … 1000; 0 = the output's own
  Duration duration{};   ///< at most 10 s

  bool operator==(const Vibration&) const = default;
};

using OutputSetting = std::variant<LampColour, Vibration>;

/// Which kind of output a setting is for.
inline OutputKind kind_of(const OutputSetting& setting) noexcept {
  return std::holds_alternative<LampColour>(setting) ? OutputKind::kLamp : OutputKind::kVibration;
}

/// The setting that turns an output of that kind off.
inline OutputSetting turned_off(OutputKind kind) noexcept {
  return kind == OutputKind::kLamp ? OutputSetting(LampColour{}) : OutputSetting(Vibration{});
}

}  // namespace tendon
