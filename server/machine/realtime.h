// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tendon {

inline constexpr int kHapticPriority = 70;  ///< below watchdog and migration threads (99), above IRQ threads (50)

/// Sets the default stack size to 256 kB, because 8 MB would count against RLIMIT_MEMLOCK, unless thread-local data
/// would not fit, for example with the thread sanitizer. Must be called before the first thread is started.
void use_small_stacks();

/// Configures the calling thread as a haptic thread: SCHED_FIFO with a `priority` from 1 to 99, no timer slack, and a
/// touched stack. Pages are locked when they are first used, and those that a haptic step may need are loaded
/// immediately. If a request is refused, the thread still runs, but may wake up late. Returns a message for each
/// refusal, with instructions for the operator.
std::vector<std::string> enter_realtime(int priority);

/// Pins the calling thread to a processor. Returns an error message if the kernel refuses.
std::optional<std::string> stay_on(std::uint32_t cpu);

int processors_allowed();

/// Disables sleep states with a long exit latency while this object exists, which increases the power consumption. It
/// writes a 32-bit value of 0 µs to /dev/cpu_dma_latency and keeps it open (Documentation/power/pm_qos_interface.rst).
/// A missing file is not an error, because the kernel does not support this setting. Thread-safe: no.
class WakefulProcessors {
 public:
  explicit WakefulProcessors(const std::filesystem::path& file = "/dev/cpu_dma_latency");
  ~WakefulProcessors();
  WakefulProcessors(const WakefulProcessors&) = delete;
  WakefulProcessors& operator=(const WakefulProcessors&) = delete;

  bool held() const noexcept { return held_; }
  const std::optional<std::string>& refused() const noexcept { return refused_; }

 private:
  int file_ = -1;
  bool held_ = false;
  std::optional<std::string> refused_;
};

/// Names the calling thread for top -H, perf and gdb, in at most 15 characters. See server/THREADS.md.
void name_thread(const std::string& name);

void enter_punctual();  ///< disables timer slack, for network and log threads

}  // namespace tendon
