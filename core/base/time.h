// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace tendon {

/// A length of time in whole nanoseconds. Every interval in Tendon is one of these.
using Duration = std::chrono::nanoseconds;

/// The monotonic clock of this machine, as a type only. It has no `now()`, so code that merely handles times cannot
/// read a clock. The owner of a real or a simulated clock passes times in.
struct LocalClock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<LocalClock>;
  static constexpr bool is_steady = true;
};

/// The monotonic clock of the peer. Its zero and its rate are not ours: `LocalTime - PeerTime` does
/// not compile (see the test `Time.APeersTimeCannotBeSubtractedFromOurs`).
struct PeerClock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<PeerClock>;
  static constexpr bool is_steady = true;
};

using LocalTime = LocalClock::time_point;
using PeerTime = PeerClock::time_point;

/// Seconds, for equations.
constexpr double seconds(Duration d) noexcept { return std::chrono::duration<double>(d).count(); }

/// The nearest whole number of nanoseconds at or below `s` seconds. `s` must be finite and within
/// ±292 years.
constexpr Duration from_seconds(double s) noexcept {
  return std::chrono::floor<Duration>(std::chrono::duration<double, std::nano>(s * 1e9));
}

}  // namespace tendon
