// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace tendon {

using Duration = std::chrono::nanoseconds;

/// The monotonic clock of this machine, as a type only. There is no `now()`; times are passed in.
struct LocalClock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<LocalClock>;
  static constexpr bool is_steady = true;
};

/// The monotonic clock of the peer has a different zero and rate. `LocalTime - PeerTime` does not compile (test
/// `Time.APeersTimeCannotBeSubtractedFromOurs`).
struct PeerClock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<PeerClock>;
  static constexpr bool is_steady = true;
};

using LocalTime = LocalClock::time_point;
using PeerTime = PeerClock::time_point;

constexpr double seconds(Duration d) noexcept { return std::chrono::duration<double>(d).count(); }

/// Rounds down to whole nanoseconds. `s` must be finite, and its magnitude must not exceed 292 years.
constexpr Duration from_seconds(double s) noexcept {
  return std::chrono::floor<Duration>(std::chrono::duration<double, std::nano>(s * 1e9));
}

}  // namespace tendon
