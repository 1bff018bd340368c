// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/output.h"

namespace tendon {

/// The lamps and the vibration of a simulated device: they keep what was set, for whoever looks.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class SimulatedOutputs {
 public:
  SimulatedOutputs() = default;
  /// Throws std::invalid_argument when there are more than kMostOutputs.
  explicit SimulatedOutputs(const std::vector<OutputDescription>& outputs);

  /// A setting of another kind than the output's, or beyond the last output, changes nothing.
  void set(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;

  /// The colour of a lamp, 0xRRGGBB; 0 for one that is off, and for what is no lamp.
  std::uint32_t colour(std::uint32_t output) const noexcept;
  /// The amplitude of a vibration; 0 after the end of its pulse, and for what does not vibrate.
  double amplitude(LocalTime now, std::uint32_t output) const noexcept;

 private:
  struct Output {
    OutputSetting setting{};
    LocalTime since{};
  };
  std::vector<Output> outputs_;
};

}  // namespace tendon
