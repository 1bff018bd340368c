// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Indicates that the haptic thread is running, and whether the device renders a force. In shared memory.
/// Realtime-safe: yes. One thread calls `beat`; `last` may be called from any thread or process.
class Heartbeat {
 public:
  /// If there is no step for this time, the guardian ends the force and the device must be armed again (SafeDevice).
  static constexpr Duration kStill = std::chrono::milliseconds(20);

  void beat(bool holds_force) noexcept {
    ++steps_;
    last_.store(steps_ << 1U | (holds_force ? 1U : 0U), std::memory_order_relaxed);
  }

  struct Beat {
    std::uint64_t steps = 0;
    bool holds_force = false;
    bool operator==(const Beat&) const = default;
  };
  Beat last() const noexcept {
    const std::uint64_t value = last_.load(std::memory_order_relaxed);
    return {.steps = value >> 1U, .holds_force = (value & 1U) != 0};
  }

 private:
  std::uint64_t steps_ = 0;
  std::atomic<std::uint64_t> last_{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
};

}  // namespace tendon
