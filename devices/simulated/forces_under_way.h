// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/base/motion.h"

namespace tendon {

/// A queue of commands from the loop to the motors, with a constant delay. If commands are sent faster than every 100
/// µs, the newest one may be replaced. Thread-safe: no. Realtime-safe: all except the constructor, which allocates.
class ForcesUnderWay {
 public:
  struct Command {
    Duration arrives{};
    Effort effort;
  };

  /// `delay` must be ≥ 0.
  explicit ForcesUnderWay(Duration delay) : delay_(delay), ring_(static_cast<std::size_t>(delay / kClosest) + 2) {}

  void send(Duration now, const Effort& effort) noexcept {
    const Duration arrives = now + delay_;
    const bool again = count_ > 0 && newest().arrives == arrives;
    if (!again && count_ < ring_.size()) ++count_;
    newest() = {arrives, effort};
  }

  const Command* next() const noexcept { return count_ > 0 ? &ring_[first_] : nullptr; }

  void pop() noexcept {
    first_ = (first_ + 1) % ring_.size();
    --count_;
  }

 private:
  static constexpr Duration kClosest = std::chrono::microseconds(100);

  Command& newest() noexcept { return ring_[(first_ + count_ - 1) % ring_.size()]; }

  Duration delay_;
  std::vector<Command> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tendon
