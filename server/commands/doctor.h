// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// The result of `tendond doctor`, which checks whether this machine is suitable for a haptic loop. It does not change
/// any settings.
struct Diagnosis {
  /// The wake-up latency of a thread that sleeps for a period of 1 ms, measured like in cyclictest. This is a lower
  /// bound for the jitter of a haptic loop.
  struct WakeUps {
    std::size_t count = 0;
    Duration median{};
    Duration p99{};
    Duration longest{};
  };
  struct Finding {
    std::string_view key;
    std::string found;
    std::string advice;  ///< empty if there is nothing to change
  };

  WakeUps ordinary;                  ///< for an ordinary thread
  WakeUps realtime;                  ///< for a thread with the settings of a haptic thread
  std::vector<std::string> refused;  ///< errors of enter_realtime
  std::vector<Finding> findings;
};

struct WakeUpClock {
  std::function<LocalTime()> now;
  std::function<void(LocalTime)> sleep_until;
};

/// Measures the latency of `count` wake-ups with this period.
Diagnosis::WakeUps measure_wake_ups(const WakeUpClock& clock, Duration period, std::size_t count);

/// Checks the settings of the kernel in proc, sys and boot below `root`. If a file is missing, the result is "unknown"
/// without advice.
std::vector<Diagnosis::Finding> look_around(const std::filesystem::path& root);

/// Runs all checks. This takes about two seconds and uses additional threads.
Diagnosis diagnose(const WakeUpClock& clock);

/// The report as text, or as one line with a JSON object.
std::string in_words(const Diagnosis& diagnosis);
std::string in_json(const Diagnosis& diagnosis);

}  // namespace tendon
