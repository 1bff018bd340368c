// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace tendon::bridge::chai3d {

// Memory shared between tendon-bridge, which creates it, and libhdPhantom.so in the program. Neither side blocks the
// other. All values are in SI units and in the frame of CHAI3D (x to the user, y right, z up). Times are in ns and use
// CLOCK_MONOTONIC.

/// A value under a sequence lock, shared between processes. If a writer dies in put(), get() fails but does not block.
/// Thread-safe: one writer at a time, any number of readers. Realtime-safe: yes.
template <typename T>
class Box {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint64_t) == 0);
  static constexpr std::size_t kWords = sizeof(T) / sizeof(std::uint64_t);

 public:
  void put(const T& value) noexcept {
    std::array<std::uint64_t, kWords> words;
    std::memcpy(words.data(), &value, sizeof(T));
    const std::uint64_t turn = turn_.load(std::memory_order_relaxed) | 1U;
    turn_.store(turn, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
    turn_.store(turn + 1, std::memory_order_release);
  }

  /// Returns false, with `value` unchanged, before the first put() or if a write is in progress in kTries attempts.
  bool get(T& value) const noexcept {
    std::array<std::uint64_t, kWords> words;
    for (int i = 0; i < kTries; ++i) {
      const std::uint64_t before = turn_.load(std::memory_order_acquire);
      if (before == 0) return false;
      if ((before & 1U) != 0) continue;
      for (std::size_t w = 0; w < kWords; ++w) words[w] = words_[w].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (turn_.load(std::memory_order_relaxed) != before) continue;
      std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
      return true;
    }
    return false;
  }

 private:
  static constexpr int kTries = 1000;  ///< this takes some µs, and a write has 30 stores
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

  std::atomic<std::uint64_t> turn_{0};  ///< odd during a write, 0 before the first
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

/// From tendon-bridge to the program.
struct HandNow {
  std::int64_t at_ns = 0;  ///< arrival time
  std::uint64_t tick = 0;
  std::array<double, 3> position{};
  std::array<double, 3> velocity{};
  std::array<double, 9> rotation{};  ///< row-major; the identity if it is not measured
  std::uint64_t buttons = 0;
};

/// From the program to tendon-bridge.
struct Asked {
  std::int64_t at_ns = 0;   ///< time of the request
  std::uint64_t count = 0;  ///< number of requests so far; a new value marks a new request
  std::uint64_t open = 0;   ///< 0 if the program has closed the device
  std::array<double, 3> force{};
  std::array<double, 3> torque{};
};

struct SharedDevice {
  Box<HandNow> hand;
  Box<Asked> asked;
  std::atomic<std::int32_t> owner{0};  ///< process that opened the device; 0: none
  double workspace_radius = 0;         ///< m; this and `model` are written before `ready`
  std::array<char, 255> model{};       ///< NUL-terminated
};

struct SharedHands {
  static constexpr std::uint32_t kVersion = 1;
  static constexpr std::size_t kMaxDevices = 16;  ///< limit of CHAI3D

  std::uint32_t version = kVersion;
  std::uint32_t devices = 0;
  std::uint32_t paced = 1;                ///< whether the force functions wait for the next state
  std::atomic<std::uint32_t> ready{0};    ///< 1 if all devices have sent a state
  std::atomic<std::uint32_t> news{0};     ///< futex; incremented with every state
  std::atomic<std::uint32_t> waiting{0};  ///< number of threads waiting on `news`
  std::array<SharedDevice, kMaxDevices> device;
};

/// Environment of the library: path of the memory, /proc/PID/fd/N; abstract name of the socket that wakes the bridge.
inline constexpr const char* kMemoryVariable = "TENDON_CHAI3D_MEMORY";
inline constexpr const char* kWakeVariable = "TENDON_CHAI3D_WAKE";

}  // namespace tendon::bridge::chai3d
