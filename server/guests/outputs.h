// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/output.h"

namespace tendon {

/// What the outputs of a device are set to, for its loop: all of them, so that the newest of these values is enough.
struct OutputSettings {
  struct One {
    std::uint32_t number = 0;  ///< of the setting: another one is to be carried out, even when it is the same; 0: none
    OutputSetting setting{};
  };
  std::array<One, kMostOutputs> of{};
};

/// Who has set which output of a device, by connection id; 0 = nobody. An output is off again when that guest gives a
/// channel of the device up or loses it, and when the device is disarmed.
///
/// Thread-safe: no. Realtime-safe: yes.
class Outputs {
 public:
  /// `output` < kMostOutputs.
  void set(std::uint32_t guest, std::size_t output, const OutputSetting& setting) noexcept;
  /// Turns off what that guest has set. False when it had set nothing.
  bool turn_off_those_of(std::uint32_t guest) noexcept;
  /// Turns off what anybody has set. False when nobody had set anything.
  bool turn_off_all() noexcept;

  const OutputSettings& settings() const noexcept { return settings_; }

 private:
  bool turn_off(std::size_t output) noexcept;

  OutputSettings settings_;
  std::array<std::uint32_t, kMostOutputs> set_by_{};
};

}  // namespace tendon
