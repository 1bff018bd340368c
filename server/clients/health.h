// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/time.h"
#include "core/exchange/counter.h"
#include "devices/counts.h"
#include "protocol/messages.h"
#include "server/recording/records.h"

namespace tendon {

/// All counters start at 0 when the server starts, so lost updates do not lose events.
struct Health {
  LocalTime at{};
  std::uint64_t steps = 0;
  std::uint64_t missed = 0;  ///< periods without a step because a step was late
  std::uint64_t overruns = 0;
  std::uint64_t unseen = 0;
  /// Intervals above AOL+'s bounded_acceleration, whose value is then wrong (core/PROOFS.md, "Bounded acceleration").
  std::uint64_t broken_assumptions = 0;
  DeviceCounts device{};
  LatenessHistogram lateness{};
  Safety safety = Safety::kAbsent;
  std::string_view fault{};  ///< static string; empty if there is no fault

  bool not_realtime = false;  ///< see enter_realtime
  bool recording_ended = false;
  std::uint64_t steps_lost = 0;  ///< lost because the log thread was too slow
  std::uint64_t unsent = 0;      ///< datagrams of the whole server that were refused by the system
};

/// Counts the events in the steps of a loop. The steps must be passed in order.
///
///     late   = hand.at − scheduled
///     missed = ⌊(scheduled − previous scheduled) / period⌋ − 1
/// Thread-safe: `counted` can be called from any thread, `observe` must be called from a single thread.
/// Realtime-safe: yes, except for the constructor.
class HealthMeter {
 public:
  /// Throws std::invalid_argument if the period is not positive.
  explicit HealthMeter(Duration period);

  void observe(const StepRecord& step) noexcept;
  /// Returns the counters. The time and the counters that do not depend on steps are not set.
  Health counted() const noexcept;

 private:
  Duration period_;
  std::optional<LocalTime> before_;
  Counter missed_;
  Counter overruns_;
  Counter unseen_;
  Counter broken_assumptions_;
  std::array<Counter, limits::kLatenessBuckets> lateness_;
};

/// Returns the changes. The number of the report and the device are not set.
DeviceReport report(const Health& before, const Health& now);

}  // namespace tendon
