// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace tendon {

/// Keeps the last N values of a loop that must not stop to write anything down. A fault freezes it;
/// then another thread can read what led to the fault, at leisure, and thaw it.
///
/// Thread-safe: one thread records and freezes; another reads and thaws, only while it is frozen.
/// Realtime-safe when copying T is.
template <typename T, std::size_t N>
class FlightRecorder {
 public:
  /// Recording thread. Does nothing while frozen.
  void record(const T& value) {
    if (frozen()) return;
    values_[count_ % N] = value;
    ++count_;
  }

  /// Recording thread: nothing is overwritten from now on.
  void freeze() noexcept { frozen_.store(true, std::memory_order_release); }

  bool frozen() const noexcept { return frozen_.load(std::memory_order_acquire); }

  /// Reading thread: starts anew. Only while frozen.
  void thaw() noexcept {
    count_ = 0;
    frozen_.store(false, std::memory_order_release);
  }

  /// How many values are kept, at most N. Only while frozen (or on the recording thread).
  std::size_t size() const noexcept { return count_ < N ? count_ : N; }

  /// The i-th oldest kept value, i < size(). Only while frozen (or on the recording thread).
  const T& operator[](std::size_t i) const noexcept { return values_[count_ < N ? i : (count_ + i) % N]; }

 private:
  std::array<T, N> values_{};
  std::size_t count_ = 0;
  std::atomic<bool> frozen_{false};
};

}  // namespace tendon
