// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tendon {

/// Hands the newest value from one thread to another, wait-free on both sides. Older values that were not taken in time
/// are forgotten. For values that are worth something only while they are new: the remote force, the state of the
/// device.
///
/// Three slots: the writer's, the reader's and the one in between, exchanged by one atomic byte.
///
/// Thread-safe: one writer thread, one reader thread. Realtime-safe when copying T is.
template <typename T>
class Latest {
 public:
  /// Writer only.
  void put(const T& value) {
    back() = value;
    put();
  }
  /// Writer only: to write a value in place. `put` publishes what `back` is by then; before, it is an older value.
  T& back() { return slots_[back_]; }
  void put() { back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  /// Reader only: the newest value, or null when nothing was put since the last `take`. Valid until the
  /// next `take`.
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
  alignas(64) std::uint8_t back_ = 0;                ///< the writer's
  alignas(64) std::atomic<std::uint8_t> middle_{1};  ///< the exchanged one, and whether it is fresh
  alignas(64) std::uint8_t front_ = 2;               ///< the reader's
};

}  // namespace tendon
