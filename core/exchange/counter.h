// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace tendon {

/// A counter that is written by one thread and can be read by any thread. Thread-safe: `value` can be called from any
/// thread, and the other functions only from the writer. Realtime-safe.
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
