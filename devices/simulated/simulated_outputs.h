// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/output.h"

namespace tendon {

/// Simulated lamps and vibration, with their last settings. Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedOutputs {
 public:
  SimulatedOutputs() = default;
  /// Throws std::invalid_argument if there are more than kMostOutputs.
  explicit SimulatedOutputs(const std::vector<OutputDescription>& outputs);

  void set(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;

  std::uint32_t colour(std::uint32_t output) const noexcept;             ///< 0xRRGGBB; 0 if it is off, or not a lamp
  double amplitude(LocalTime now, std::uint32_t output) const noexcept;  ///< 0 after a pulse, or if not a vibration

 private:
  struct Output {
    OutputSetting setting{};
    LocalTime since{};
  };
  std::vector<Output> outputs_;
};

}  // namespace tendon
