// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <stdexcept>

#include "core/base/expect.h"

namespace tendon {

/// A wait-free queue from one thread to another, for values whose loss must be detected, such as the recording or
/// commands. Only the constructor allocates memory.
/// Thread-safe: can be used by one writer thread and one reader thread. Realtime-safe when copying T is.
template <typename T>
class SpscRing {
  static_assert(std::atomic<std::size_t>::is_always_lock_free);

 public:
  /// Holds up to `capacity` values. Throws std::invalid_argument if it is not a power of two.
  explicit SpscRing(std::size_t capacity) : slots_(std::make_unique<T[]>(capacity)), mask_(capacity - 1) {
    expect(std::has_single_bit(capacity), "capacity", static_cast<double>(capacity), "a power of two");
  }

  /// Writer only. Returns the slot of the next value, or null if the ring is full. The slot contains an older value. It
  /// is not visible to the reader until `push` is called. For large values that are written in place.
  T* back() {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) > mask_) return nullptr;
    return &slots_[head & mask_];
  }

  /// Writer only, after `back` returned a slot.
  void push() { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Writer only. Returns false, without taking the value, if the ring is full.
  bool try_push(const T& value) {
    T* const slot = back();
    if (slot == nullptr) return false;
    *slot = value;
    push();
    return true;
  }

  /// Reader only. Returns the oldest value, or null if the ring is empty. Valid until `pop`.
  const T* front() const {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return nullptr;
    return &slots_[tail & mask_];
  }

  /// Reader only, after `front` returned a value.
  void pop() { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

 private:
  std::unique_ptr<T[]> slots_;
  std::size_t mask_;
  alignas(64) std::atomic<std::size_t> head_{0};  ///< next to write
  alignas(64) std::atomic<std::size_t> tail_{0};  ///< next to read
};

}  // namespace tendon
