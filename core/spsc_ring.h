// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace tendon {

/// Hands every value from one thread to another in order, wait-free on both sides; when the reader is
/// too slow, `try_push` says so and the value is not taken. For what must not be lost unnoticed: steps
/// and datagrams on their way to the recording, commands to the haptic thread.
///
/// Holds up to N values; N is a power of two.
///
/// Thread-safe: one writer thread, one reader thread. Realtime-safe when copying T is.
template <typename T, std::size_t N>
class SpscRing {
  static_assert(N > 0 && (N & (N - 1)) == 0, "N must be a power of two");
  static_assert(std::atomic<std::size_t>::is_always_lock_free);

 public:
  /// Writer only. False, and nothing is taken, when the ring is full.
  bool try_push(const T& value) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == N) return false;
    slots_[head % N] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Reader only: the oldest value, or null when empty. Valid until `pop`.
  const T* front() const {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return nullptr;
    return &slots_[tail % N];
  }

  /// Reader only, and only after `front` was not null.
  void pop() { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

 private:
  std::array<T, N> slots_{};
  alignas(64) std::atomic<std::size_t> head_{0};  ///< next to write
  alignas(64) std::atomic<std::size_t> tail_{0};  ///< next to read
};

}  // namespace tendon
