// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// When a device's newest haptic steps were sampled, by tick: a force names the tick that it answers.
///
/// Thread-safe: no. Realtime-safe: yes, except for the constructor.
class SampledSteps {
 public:
  static constexpr std::size_t kRemembered = 4096;  ///< 4 s at 1 kHz, longer than any loop worth rendering

  struct Step {
    LocalTime at{};    ///< sampled
    LocalTime sent{};  ///< its state left
  };

  SampledSteps() : steps_(kRemembered) {}

  /// The state of `tick`, sampled at `at`, leaves at `sent`. A client may answer a predicted tick, even one whose state
  /// the network thread never saw: the steps since the last state are taken to be evenly spaced.
  void observe(std::uint64_t tick, LocalTime at, LocalTime sent);

  /// Empty when there was no such step, or it was longer ago than kRemembered steps.
  std::optional<Step> find(std::uint64_t tick) const;

  /// The newest tick that was observed; 0 before the first.
  std::uint64_t newest() const noexcept { return newest_; }

 private:
  struct Numbered {
    std::uint64_t tick = 0;
    Step step{};
  };
  std::vector<Numbered> steps_;
  std::uint64_t newest_ = 0;
};

}  // namespace tendon
