// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/exchange/counter.h"

namespace tendon {

/// Events counted by a driver since its construction, if its device can show them. In the order of `kDeviceCounters`.
enum class DeviceCount : std::uint8_t {
  kAnswers,
  kUnreadable,
  kFailedSetups,
  kLostCounts,
  kSilences,
  kImplausible,
  kUnreachable,
  kUnanswered,
};

/// `tendond --json` uses the name, the log the meaning, and observers and /metrics the reason for a degraded device.
struct DeviceCounter {
  DeviceCount count;
  std::string_view name;  ///< key in `tendond --json`
  std::string_view meaning;
  std::string_view degraded;  ///< sent to observers, if not empty
};

/// If several counters have increased, a report only contains the first reason. Each reason has at most 18 bytes.
inline constexpr std::array kDeviceCounters = {
    DeviceCounter{DeviceCount::kAnswers, "answers", "replies of the device that were accepted", ""},
    // A serial line can start in the middle of an answer, so a few bytes after opening are normal.
    DeviceCounter{DeviceCount::kUnreadable, "unreadable", "packets, or bytes on a serial line, that are not a reply",
                  ""},
    DeviceCounter{DeviceCount::kFailedSetups, "failed_setups",
                  "failed transfers of the firmware, or failed calibrations", "set-up fails"},
    DeviceCounter{DeviceCount::kLostCounts, "lost_counts",
                  "losses of encoder counts, after which the device must be homed again", "counts were lost"},
    DeviceCounter{DeviceCount::kSilences, "silences",
                  "silences of the device for 100 ms, after which it is opened again", "device is silent"},
    DeviceCounter{DeviceCount::kImplausible, "implausible",
                  "rejected replies, because no hand can move the encoders so far", "encoders jump"},
    DeviceCounter{DeviceCount::kUnreachable, "unreachable",
                  "rejected replies, because their encoder values belong to no position", "impossible pose"},
    DeviceCounter{DeviceCount::kUnanswered, "unanswered", "requests without a reply in time, which the driver repeated",
                  "replies are late"},
};
static_assert([] {
  for (std::size_t i = 0; i < kDeviceCounters.size(); ++i) {
    if (static_cast<std::size_t>(kDeviceCounters[i].count) != i) return false;
  }
  return true;
}());

struct DeviceCounts {
  std::array<std::uint64_t, kDeviceCounters.size()> values{};

  constexpr std::uint64_t operator[](DeviceCount count) const noexcept {
    return values[static_cast<std::size_t>(count)];
  }
  friend bool operator==(const DeviceCounts&, const DeviceCounts&) = default;
};

/// Thread-safe: `counts` only. Realtime-safe.
class DeviceCountersKept {
 public:
  void add(DeviceCount count) noexcept { kept_[static_cast<std::size_t>(count)].add(); }
  void set(DeviceCount count, std::uint64_t number) noexcept { kept_[static_cast<std::size_t>(count)].set(number); }

  DeviceCounts counts() const noexcept {
    DeviceCounts now;
    for (std::size_t i = 0; i < kept_.size(); ++i) now.values[i] = kept_[i].value();
    return now;
  }

 private:
  std::array<Counter, kDeviceCounters.size()> kept_;
};

}  // namespace tendon
