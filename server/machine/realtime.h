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

/// Gives each thread that the process starts from now on a stack of 256 kB. The system's 8 MB for each would count in
/// full where locked memory is limited (RLIMIT_MEMLOCK). Stacks stay as they are where what is local to a thread does not
/// fit, as with the thread sanitizer. Before the first thread.
void use_small_stacks();

/// Asks the kernel to treat the calling thread as a haptic thread: SCHED_FIFO, no timer slack, memory locked, stack
/// touched beforehand. Every page of the process is locked from its first use on. Those that a step may use are brought
/// in now: the program, the C library and its mathematics, the heap; rings and mailboxes are written when they are
/// made. Returns a plain sentence for each request that was refused, which says what would grant it. The thread then
/// runs all the same, but may wake late.
///
/// `priority`: 1…99.
std::vector<std::string> enter_realtime(int priority);

/// Keeps the calling thread on processor `cpu` (from 0), where nothing else should run (`isolcpus`). Returns a plain
/// sentence when the kernel refuses; the thread then runs where it did.
std::optional<std::string> stay_on(std::uint32_t cpu);

/// Processors that this process may run on, at least 1.
int processors_allowed();

/// While it lives, keeps the processors out of sleep states that are slow to leave: it holds /dev/cpu_dma_latency open,
/// with 0 µs written to it as 32 bits (Documentation/power/pm_qos_interface.rst). Costs power. A kernel without that
/// file has no such states, or does not offer the choice: that does not count as a refusal.
///
/// Thread-safe: no.
class WakefulProcessors {
 public:
  explicit WakefulProcessors(const std::filesystem::path& file = "/dev/cpu_dma_latency");
  ~WakefulProcessors();
  WakefulProcessors(const WakefulProcessors&) = delete;
  WakefulProcessors& operator=(const WakefulProcessors&) = delete;

  bool held() const noexcept { return held_; }
  /// When the kernel refused: a plain sentence that says what would grant it; else empty.
  const std::optional<std::string>& refused() const noexcept { return refused_; }

 private:
  int file_ = -1;
  bool held_ = false;
  std::optional<std::string> refused_;
};

/// Names the calling thread for top -H, perf and gdb. At most 15 characters are kept. server/THREADS.md lists all
/// threads and what each does.
void name_thread(const std::string& name);

/// For a network or log thread: only turns timer slack off.
void enter_punctual();

}  // namespace tendon
