// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace tendon {

/// A counter that one thread writes and any thread can read.
///
/// Thread-safe: `value` from any thread, the rest from one. Realtime-safe.
class Counter {
 public:
  /// With one writer a load and a store are sufficient, without an atomic read-modify-write.
  void add() noexcept { set(value() + 1); }
  void set(std::uint64_t count) noexcept { count_.store(count, std::memory_order_relaxed); }
  std::uint64_t value() const noexcept { return count_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace tendon
