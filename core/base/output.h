// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "core/base/time.h"

// Outputs of a device other than forces: lamps, and vibration that the position motors do not generate. The energy
// ledger ignores them.

namespace tendon {

/// The maximum number of outputs of a device.
inline constexpr std::size_t kMostOutputs = 8;

/// Part of the wire format: never renumber.
enum class OutputKind : std::uint8_t { kLamp = 1, kVibration = 2 };

/// One output of a device.
struct OutputDescription {
  std::string name;  ///< at most 24 bytes
  OutputKind kind = OutputKind::kLamp;

  bool operator==(const OutputDescription&) const = default;
};

/// The colour of a lamp. 0 = off: the device controls the lamp.
struct LampColour {
  std::uint32_t rgb = 0;  ///< 0xRRGGBB

  bool operator==(const LampColour&) const = default;
};

/// A vibration pulse, like XrHapticVibration in OpenXR. A new pulse replaces the current one.
struct Vibration {
  double amplitude = 0;  ///< [0, 1], relative to the maximum of the output; 0 = off
  double frequency = 0;  ///< Hz, 20 … 1000; 0 = default of the output
  Duration duration{};   ///< at most 10 s

  bool operator==(const Vibration&) const = default;
};

using OutputSetting = std::variant<LampColour, Vibration>;

/// Returns the kind of output of a setting.
inline OutputKind kind_of(const OutputSetting& setting) noexcept {
  return std::holds_alternative<LampColour>(setting) ? OutputKind::kLamp : OutputKind::kVibration;
}

/// Returns the setting to turn off an output.
inline OutputSetting turned_off(OutputKind kind) noexcept {
  return kind == OutputKind::kLamp ? OutputSetting(LampColour{}) : OutputSetting(Vibration{});
}

}  // namespace tendon
