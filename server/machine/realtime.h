// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tendon {

/// This is below the watchdog and migration threads of the kernel (99), and above ordinary IRQ threads (50).
inline constexpr int kHapticPriority = 70;

/// Sets the default stack size of new threads to 256 kB. The default of 8 MB would count against the limit of locked
/// memory (RLIMIT_MEMLOCK). The size is not changed if thread-local data would not fit, for example with the thread
/// sanitizer. This must be called before the first thread is started.
void use_small_stacks();

/// Configures the calling thread as a haptic thread. It uses SCHED_FIFO, disables timer slack, locks the memory, and
/// touches the stack. Pages are locked when they are first used. The pages that a haptic step may need are loaded
/// immediately, including the program, the C library, the math library and the heap. Rings and mailboxes are already
/// initialized when they are created. If a request is refused, the thread still runs, but it may wake up late. Returns
/// a message for each of these requests, with instructions for the operator.
///
/// The `priority` must be from 1 to 99.
std::vector<std::string> enter_realtime(int priority);

/// Pins the calling thread to a processor, which should not be used by other threads (`isolcpus`). Returns an error
/// message if this is refused by the kernel.
std::optional<std::string> stay_on(std::uint32_t cpu);

/// Returns the number of processors that this process can use, which is at least 1.
int processors_allowed();

/// Prevents the processors from entering sleep states with a long exit latency while this object exists. To do this, it
/// keeps /dev/cpu_dma_latency open after writing a 32-bit value of 0 µs (Documentation/power/pm_qos_interface.rst).
/// This increases the power consumption. If the file does not exist, this is not treated as an error because such a
/// kernel either has no deep sleep states or does not support this setting.
///
/// Thread-safe: no.
class WakefulProcessors {
 public:
  explicit WakefulProcessors(const std::filesystem::path& file = "/dev/cpu_dma_latency");
  ~WakefulProcessors();
  WakefulProcessors(const WakefulProcessors&) = delete;
  WakefulProcessors& operator=(const WakefulProcessors&) = delete;

  bool held() const noexcept { return held_; }
  /// Returns an error message with instructions if the kernel has refused the request.
  const std::optional<std::string>& refused() const noexcept { return refused_; }

 private:
  int file_ = -1;
  bool held_ = false;
  std::optional<std::string> refused_;
};

/// Sets the name of the calling thread for top -H, perf and gdb. It is truncated to 15 characters. See
/// server/THREADS.md for a list of all threads.
void name_thread(const std::string& name);

/// Disables timer slack. This is used for network and log threads.
void enter_punctual();

}  // namespace tendon
