// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tendon {

/// A wait-free slot that passes the newest value from one thread to another. A slow reader misses older values. Use it
/// for values that are only useful while they are new, such as the remote force or the device state. There are three
/// slots: one of the writer, one of the reader, and one that they exchange through an atomic byte.
/// Thread-safe: can be used by one writer thread and one reader thread. Realtime-safe when copying T is.
template <typename T>
class Latest {
 public:
  /// Writer only.
  void put(const T& value) {
    back() = value;
    put();
  }
  /// Writer only. The slot for a value that is written in place and published by `put`. It contains an older value.
  T& back() { return slots_[back_]; }
  void put() { back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  /// Reader only. Returns the newest value, or null if there is none since the last call. Valid until the next call.
  const T* take() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return nullptr;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &slots_[front_];
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndex = 3;
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

  std::array<T, 3> slots_{};
  alignas(64) std::uint8_t back_ = 0;                ///< slot of the writer
  alignas(64) std::atomic<std::uint8_t> middle_{1};  ///< exchanged slot, and whether it is fresh
  alignas(64) std::uint8_t front_ = 2;               ///< slot of the reader
};

}  // namespace tendon
