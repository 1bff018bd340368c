// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/control/limiter.h"
#include "core/time.h"

namespace tendon {

/// The haptic half of the server on a Falcon through the real libusb: HapticLoop with a limiter at 1 kHz, a remote wall
/// of 500 N/m at x = 0 that answers every tenth step, a hand that moves ±20 mm through it every two seconds, and,
/// beside it on another thread, one that only sleeps: the floor.
struct FalconLoopReport {
  std::uint64_t steps = 0;
  std::uint64_t missed = 0;    ///< periods left out, because the thread woke a whole one late or more
  std::uint64_t unseen = 0;    ///< steps without a new position
  std::uint64_t overruns = 0;  ///< intervals of more than two periods
  double late_p50_us = 0;      ///< from when a step was due to when it began
  double late_p99_us = 0;
  double floor_p50_us = 0;  ///< the same of the thread that only sleeps
  double floor_p99_us = 0;
  double work_p50_us = 0;  ///< of HapticLoop::step
  double wall_share = 0;   ///< mean of (force at the motors) / (force of the wall), deeper than 5 mm
  /// Of those steps, the ones with a new position, as the step before: the motors then have what was written in one of
  /// the two, however late that was.
  std::uint64_t checked = 0;
  std::uint64_t at_odds = 0;     ///< … and they have neither, by more than 0.1 N and a fifth
  std::uint64_t pushed = 0;      ///< … and they push out of the wall, with more than 1 N
  double least_energy = 0;       ///< J, of the limiter's account
  std::uint64_t heap_calls = 0;  ///< in HapticLoop::step, as `heap_calls_now` counts them

  std::string json() const;
};

/// `heap_calls_now`: heap calls of this thread so far; empty: not counted.
FalconLoopReport run_falcon_loop(Duration duration, Law limiter, const std::function<std::uint64_t()>& heap_calls_now);

}  // namespace tendon
