// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tendon {

/// Below the kernel's own watchdog and migration threads (99) and above ordinary IRQ threads (50).
inline constexpr int kHapticPriority = 70;

/// Asks the kernel to treat the calling thread as a haptic thread: SCHED_FIFO, no timer slack, memory
/// locked, stack touched beforehand. Returns a plain sentence for each wish that was refused (with what
/// it would take to be granted); the thread runs all the same, later now and then.
///
/// `priority`: 1…99.
std::vector<std::string> enter_realtime(int priority);

/// Keeps the calling thread on processor `cpu` (from 0), where nothing else should run (`isolcpus`). Returns a plain
/// sentence when the kernel refuses; the thread then runs where it did.
std::optional<std::string> stay_on(std::uint32_t cpu);

/// Keeps the processors from sleeping so deep that waking takes long, for as long as it lives: holds the kernel's file
/// open in which 0 µs are written as 32 bits (Documentation/power/pm_qos_interface.rst). Costs power. A kernel without
/// that file has no such sleep to forbid, or does not let us: that is no refusal.
///
/// Thread-safe: no.
class WakefulProcessors {
 public:
  explicit WakefulProcessors(const std::filesystem::path& file = "/dev/cpu_dma_latency");
  ~WakefulProcessors();
  WakefulProcessors(const WakefulProcessors&) = delete;
  WakefulProcessors& operator=(const WakefulProcessors&) = delete;

  bool held() const noexcept { return held_; }
  /// A plain sentence with what it would take, when the kernel refused; else empty.
  const std::optional<std::string>& refused() const noexcept { return refused_; }

 private:
  int file_ = -1;
  bool held_ = false;
  std::optional<std::string> refused_;
};

/// Names the calling thread for people who look on: top -H, perf, gdb. At most 15 characters are kept. Which there are,
/// and what each does: server/THREADS.md.
void name_thread(const std::string& name);

/// A network or log thread: no timer slack only.
void enter_punctual();

}  // namespace tendon
