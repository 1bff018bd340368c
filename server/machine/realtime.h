// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tendon {

/// Below the watchdog and migration threads of the kernel (99), above ordinary IRQ threads (50).
inline constexpr int kHapticPriority = 70;

/// Sets the default stack size to 256 kB, because 8 MB would count against RLIMIT_MEMLOCK. It is not changed if
/// thread-local data would not fit, for example with the thread sanitizer. This must be called before the first thread
/// is started.
void use_small_stacks();

/// Configures the calling thread as a haptic thread. It uses SCHED_FIFO with a `priority` from 1 to 99, disables timer
/// slack, and touches the stack. Pages are locked when they are first used. The pages that a haptic step may need are
/// loaded immediately. If a request is refused, the thread still runs, but it may wake up late. Returns a message for
/// each of these requests, with instructions for the operator.
std::vector<std::string> enter_realtime(int priority);

/// Pins the calling thread to a processor. Returns an error message if this is refused by the kernel.
std::optional<std::string> stay_on(std::uint32_t cpu);

int processors_allowed();

/// Disables sleep states with a long exit latency while this object exists, which increases the power consumption. It
/// writes a 32-bit value of 0 µs to /dev/cpu_dma_latency and keeps it open (Documentation/power/pm_qos_interface.rst).
/// If the file does not exist, this is not an error because the kernel does not support this setting.
///
/// Thread-safe: no.
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

/// Names the calling thread for top -H, perf and gdb. The name is truncated to 15 characters. See server/THREADS.md.
void name_thread(const std::string& name);

/// Disables timer slack. This is used for network and log threads.
void enter_punctual();

}  // namespace tendon
