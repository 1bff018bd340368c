// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// Stores the times of the newest haptic steps of a device, to find the step that a force answers. Thread-safe: no.
/// Realtime-safe: yes, except for `remember`.
class SampledSteps {
 public:
  static constexpr std::size_t kRemembered = 4096;  ///< 4 s at 1 kHz

  struct Step {
    LocalTime at{};
    LocalTime sent{};  ///< clamped to `at` … `at` + 4.2 s
  };

  /// Must be called before the first client sees the steps. Before this, they do not need memory (48 kB).
  void remember();

  /// Interpolates skipped ticks, because a client can answer a predicted tick that the network thread did not receive.
  void observe(std::uint64_t tick, LocalTime at, LocalTime sent);

  std::optional<Step> find(std::uint64_t tick) const;  ///< nothing if unknown, or older than kRemembered steps

  std::uint64_t newest() const noexcept { return newest_; }

 private:
  void put(std::uint64_t tick, const Step& step);

  std::vector<LocalTime> at_{};                 ///< ring of the ticks from oldest_ to newest_
  std::vector<std::uint32_t> sent_after_ns_{};  ///< since at_
  std::uint64_t oldest_ = 1;
  std::uint64_t newest_ = 0;
};

}  // namespace tendon
