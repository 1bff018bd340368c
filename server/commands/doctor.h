// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// How well this machine can run a haptic loop, and what to change to improve it: `tendond doctor`. It looks and
/// measures, and changes nothing.
struct Diagnosis {
  /// How late a thread wakes when it sleeps until instants 1 ms apart, as cyclictest measures it. No haptic loop on
  /// this machine can do better.
  struct WakeUps {
    std::size_t count = 0;
    Duration median{};
    Duration p99{};
    Duration longest{};
  };
  struct Finding {
    std::string_view key;
    std::string found;
    std::string advice;  ///< empty: nothing to change
  };

  WakeUps ordinary;                  ///< of an ordinary thread
  WakeUps realtime;                  ///< of a thread with the settings of the haptic thread
  std::vector<std::string> refused;  ///< the settings that it was refused (enter_realtime)
  std::vector<Finding> findings;
};

/// A clock to look at, and to sleep by.
struct WakeUpClock {
  std::function<LocalTime()> now;
  std::function<void(LocalTime)> sleep_until;
};

/// Sleeps `count` times until one period after the instant before.
Diagnosis::WakeUps measure_wake_ups(const WakeUpClock& clock, Duration period, std::size_t count);

/// The kernel's settings, read below `root` (proc, sys, boot). A missing file gives "unknown", without advice.
std::vector<Diagnosis::Finding> look_around(const std::filesystem::path& root);

/// The whole examination. Takes about two seconds, in threads of its own.
Diagnosis diagnose(const WakeUpClock& clock);

/// The report for people; and a JSON object in one line.
std::string in_words(const Diagnosis& diagnosis);
std::string in_json(const Diagnosis& diagnosis);

}  // namespace tendon
