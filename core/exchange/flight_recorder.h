// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <stdexcept>

#include "core/base/expect.h"

namespace tendon {

/// Stores the last values of a loop that must not write to files. If a fault freezes it, another thread can read the
/// values before the fault. Only the constructor allocates memory.
/// Thread-safe: one thread can call `record` and `freeze`. While it is frozen, another thread can read it and call
/// `thaw`. Realtime-safe if copying T is.
template <typename T>
class FlightRecorder {
 public:
  /// Keeps the last `capacity` values. Throws std::invalid_argument if it is not a power of two.
  explicit FlightRecorder(std::size_t capacity) : values_(std::make_unique<T[]>(capacity)), capacity_(capacity) {
    expect(std::has_single_bit(capacity), "capacity", static_cast<double>(capacity), "a power of two");
  }

  /// Recording thread. Does nothing while frozen. `value` must be assignable to T.
  template <typename U = T>
  void record(const U& value) {
    if (frozen()) return;
    values_[count_ & (capacity_ - 1)] = value;
    ++count_;
  }

  void freeze() noexcept { frozen_.store(true, std::memory_order_release); }

  bool frozen() const noexcept { return frozen_.load(std::memory_order_acquire); }

  /// Reading thread, only while frozen. Removes all values and resumes recording.
  void thaw() noexcept {
    count_ = 0;
    frozen_.store(false, std::memory_order_release);
  }

  /// Must be frozen, or called from the recording thread. This is also true for operator[].
  std::size_t size() const noexcept { return count_ < capacity_ ? count_ : capacity_; }

  /// Returns the i-th oldest value, i < size().
  const T& operator[](std::size_t i) const noexcept {
    return values_[count_ < capacity_ ? i : (count_ + i) & (capacity_ - 1)];
  }

 private:
  std::unique_ptr<T[]> values_;
  std::size_t capacity_;
  std::size_t count_ = 0;
  std::atomic<bool> frozen_{false};
};

}  // namespace tendon
