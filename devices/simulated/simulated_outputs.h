// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/output.h"

namespace tendon {

/// The lamps and the vibration of a simulated device. They store the last settings for inspection.
///
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedOutputs {
 public:
  SimulatedOutputs() = default;
  /// Throws std::invalid_argument if there are more than kMostOutputs.
  explicit SimulatedOutputs(const std::vector<OutputDescription>& outputs);

  /// Ignores an index that does not exist and a setting of another kind.
  void set(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;

  /// Returns the color of a lamp, 0xRRGGBB; 0 if it is off or is not a lamp.
  std::uint32_t colour(std::uint32_t output) const noexcept;
  /// Returns the amplitude of a vibration; 0 after the end of its pulse or if it is not a vibration.
  double amplitude(LocalTime now, std::uint32_t output) const noexcept;

 private:
  struct Output {
    OutputSetting setting{};
    LocalTime since{};
  };
  std::vector<Output> outputs_;
};

}  // namespace tendon
