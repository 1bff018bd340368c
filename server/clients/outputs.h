// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/output.h"

namespace tendon {

struct OutputSettings {
  struct One {
    std::uint32_t number = 0;  ///< unique id of this setting, or 0
    OutputSetting setting{};
  };
  std::array<One, kMostOutputs> of{};
};

/// Stores which client has set each output of a device. An output is turned off if this client releases or loses a
/// channel of the device, or if the device is disarmed. Thread-safe: no. Realtime-safe: yes.
class Outputs {
 public:
  void set(std::uint32_t client, std::size_t output, const OutputSetting& setting) noexcept;
  bool turn_off_those_of(std::uint32_t client) noexcept;  ///< false if there are none
  bool turn_off_all() noexcept;                           ///< false if all are already off

  const OutputSettings& settings() const noexcept { return settings_; }

 private:
  bool turn_off(std::size_t output) noexcept;

  OutputSettings settings_;
  std::array<std::uint32_t, kMostOutputs> set_by_{};
};

}  // namespace tendon
