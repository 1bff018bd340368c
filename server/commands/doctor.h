// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// The result of `tendond doctor`: whether this machine is suitable for a haptic loop. It changes no settings.
struct Diagnosis {
  /// The wake-up latency of a thread with a period of 1 ms, as in cyclictest. A lower bound for the jitter of a loop.
  struct WakeUps {
    std::size_t count = 0;
    Duration median{};
    Duration p99{};
    Duration longest{};
  };
  struct Finding {
    std::string_view key;
    std::string found;
    std::string advice;
  };

  WakeUps ordinary;
  WakeUps realtime;
  std::vector<std::string> refused;
  std::vector<Finding> findings;
};

struct WakeUpClock {
  std::function<LocalTime()> now;
  std::function<void(LocalTime)> sleep_until;
};

Diagnosis::WakeUps measure_wake_ups(const WakeUpClock& clock, Duration period, std::size_t count);

/// Checks the kernel settings in proc, sys and boot below `root`. If a file is missing, the result is "unknown".
std::vector<Diagnosis::Finding> look_around(const std::filesystem::path& root);

/// Runs all checks, including look_at_network. This takes about two seconds and uses additional threads. `cpu` is the
/// processor of the haptic thread; if empty, the kernel chooses it.
Diagnosis diagnose(const WakeUpClock& clock, std::optional<std::uint32_t> cpu = std::nullopt);

std::string in_words(const Diagnosis& diagnosis);
std::string in_json(const Diagnosis& diagnosis);

}  // namespace tendon
