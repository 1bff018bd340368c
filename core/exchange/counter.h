// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace tendon {

/// A counter that one thread writes and any thread can read. Thread-safe: `value` from any thread, the rest from one.
/// Realtime-safe.
class Counter {
 public:
  /// An atomic read-modify-write is not needed, because there is only one writer.
  void add() noexcept { set(value() + 1); }
  void set(std::uint64_t count) noexcept { count_.store(count, std::memory_order_relaxed); }
  std::uint64_t value() const noexcept { return count_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace tendon
