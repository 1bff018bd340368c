// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// What this machine gives a haptic loop, and what to change to get more: `tendond doctor`. Looks and measures; changes
/// nothing.
struct Diagnosis {
  /// How late a thread wakes that sleeps until the next of many instants, 1 ms apart: the floor of every haptic loop
  /// here, as cyclictest measures it.
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

  WakeUps ordinary;                  ///< of a thread like any other
  WakeUps realtime;                  ///< of one that asked for what the haptic thread asks for
  std::vector<std::string> refused;  ///< … and what it was refused (enter_realtime)
  std::vector<Finding> findings;
};

/// A clock to look at, and to sleep by.
struct WakeUpClock {
  std::function<LocalTime()> now;
  std::function<void(LocalTime)> sleep_until;
};

/// Sleeps `count` times until one period after the instant before.
Diagnosis::WakeUps measure_wake_ups(const WakeUpClock& clock, Duration period, std::size_t count);

/// What the kernel says of itself below `root` (proc, sys, boot). A file that is not there is "unknown", without
/// advice.
std::vector<Diagnosis::Finding> look_around(const std::filesystem::path& root);

/// All of it. Takes some two seconds, in threads of its own.
Diagnosis diagnose(const WakeUpClock& clock);

/// For people; and a JSON object in one line.
std::string in_words(const Diagnosis& diagnosis);
std::string in_json(const Diagnosis& diagnosis);

}  // namespace tendon
