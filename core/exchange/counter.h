// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace tendon {

/// A count that one thread keeps and any thread may read.
///
/// Thread-safe: `value` from any thread, the rest from one. Realtime-safe.
class Counter {
 public:
  /// There is one writer, so a load and a store are enough: no read-modify-write, no cache line to wait for.
  void add() noexcept { set(value() + 1); }
  void set(std::uint64_t count) noexcept { count_.store(count, std::memory_order_relaxed); }
  std::uint64_t value() const noexcept { return count_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace tendon
