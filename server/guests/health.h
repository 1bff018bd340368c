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

/// How one device's loop does: what the log thread gathers, and the network thread tells observers who ask. Numbers of
/// things are since the server started, so that one that was not seen is in the next.
struct Health {
  LocalTime at{};
  std::uint64_t steps = 0;     ///< haptic steps
  std::uint64_t missed = 0;    ///< periods without a step, because the one before came so late
  std::uint64_t overruns = 0;  ///< steps with Reason::kOverrun
  std::uint64_t unseen = 0;    ///< steps with Reason::kUnseen
  /// Intervals in which the hand accelerated by more than AOL+'s bounded_acceleration allows: the scene's bound is
  /// wrong.
  std::uint64_t broken_assumptions = 0;
  DeviceCounts device{};  ///< what the device's driver has counted
  LatenessHistogram lateness{};
  Safety safety = Safety::kAbsent;
  std::string_view fault{};  ///< of static storage; empty: none

  // What the server does less of:
  bool not_realtime = false;  ///< the kernel refused the haptic thread something, see enter_realtime
  bool recording_ended = false;
  std::uint64_t steps_lost = 0;  ///< not recorded: the log thread came too late
  std::uint64_t unsent = 0;      ///< datagrams that the system did not take; of the whole server
};

/// Counts what a loop's steps tell of it, in the order in which they were taken.
///
///     late   = hand.at − scheduled, when the loop woke less when it was to
///     missed = ⌊(scheduled − scheduled before) / period⌋ − 1
///
/// Thread-safe: `counted` from any thread, `observe` from one. Realtime-safe: yes, but for the constructor.
class HealthMeter {
 public:
  /// `period` of the loop. Throws std::invalid_argument when it is not above zero.
  explicit HealthMeter(Duration period);

  void observe(const StepRecord& step) noexcept;
  /// The numbers as they are now; `at` and what steps do not tell are for others to fill in. There are as many steps as
  /// `lateness` holds.
  Health counted() const noexcept;

 private:
  Duration period_;
  std::optional<LocalTime> before_;  ///< when the step before was due
  Counter missed_;
  Counter overruns_;
  Counter unseen_;
  Counter broken_assumptions_;
  std::array<Counter, limits::kLatenessBuckets> lateness_;
};

/// What there is to tell of the time between two of them: all but `number` and `device`.
DeviceReport report(const Health& before, const Health& now);

}  // namespace tendon
