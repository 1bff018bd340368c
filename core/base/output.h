// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "core/base/time.h"

// Lamps, and vibration that the position motors do not generate. The energy ledger ignores these outputs.

namespace tendon {

inline constexpr std::size_t kMostOutputs = 8;  ///< per device

/// Part of the wire format: never renumber.
enum class OutputKind : std::uint8_t { kLamp = 1, kVibration = 2 };

struct OutputDescription {
  std::string name;  ///< at most 24 bytes
  OutputKind kind = OutputKind::kLamp;

  bool operator==(const OutputDescription&) const = default;
};

struct LampColour {
  std::uint32_t rgb = 0;  ///< 0xRRGGBB, or 0 if the device controls the lamp

  bool operator==(const LampColour&) const = default;
};

/// A vibration pulse, like XrHapticVibration in OpenXR. Replaces the current pulse, if any.
struct Vibration {
  double amplitude = 0;  ///< [0, 1], relative to the maximum of the output; 0 = off
  double frequency = 0;  ///< Hz, 20 … 1000; 0 = default of the output
  Duration duration{};   ///< at most 10 s

  bool operator==(const Vibration&) const = default;
};

using OutputSetting = std::variant<LampColour, Vibration>;

inline OutputKind kind_of(const OutputSetting& setting) noexcept {
  return std::holds_alternative<LampColour>(setting) ? OutputKind::kLamp : OutputKind::kVibration;
}

inline OutputSetting turned_off(OutputKind kind) noexcept {
  return kind == OutputKind::kLamp ? OutputSetting(LampColour{}) : OutputSetting(Vibration{});
}

}  // namespace tendon
