// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/output.h"

namespace tendon {

/// Simulated lamps and vibration, which keep the last settings. Thread-safe: no. Realtime-safe: all except the
/// constructor.
class SimulatedOutputs {
 public:
  SimulatedOutputs() = default;
  /// Throws std::invalid_argument if there are more than kMostOutputs.
  explicit SimulatedOutputs(const std::vector<OutputDescription>& outputs);

  /// Ignores unknown outputs and settings of a different kind.
  void set(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;

  /// 0xRRGGBB; 0 if the lamp is off, or if it is not a lamp.
  std::uint32_t colour(std::uint32_t output) const noexcept;
  /// 0 after the end of a pulse, or if this is not a vibration.
  double amplitude(LocalTime now, std::uint32_t output) const noexcept;

 private:
  struct Output {
    OutputSetting setting{};
    LocalTime since{};
  };
  std::vector<Output> outputs_;
};

}  // namespace tendon
