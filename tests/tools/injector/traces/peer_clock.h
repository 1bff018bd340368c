// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/time.h"

namespace tendon::injector {

/// The clock of another machine with its errors, for simulations. Every simulated peer should have one, because code
/// that compares two clocks must not rely on their being equal. Its reading at the true time t is
///
///     reading(t) = t + offset + ⌊(t − start) · drift_ppb / 10⁹⌋ + Σ change of the steps with start + at ≤ t
///
/// in integer nanoseconds, without floating point. Real clocks have arbitrary offsets (since their boot) and a drift of
/// up to 100 ppm (10⁵ ppb; quartz; 16 ppm was measured between two hosts), and step when they are set. A monotonic
/// clock steps only after a virtual machine was resumed.
///
/// Thread-safe: yes, it has no state.
class DriftingClock {
 public:
  struct Step {
    Duration at{};  ///< true time since start
    Duration change{};
    bool operator==(const Step&) const = default;
  };
  struct Config {
    Duration offset{};
    std::int64_t drift_ppb = 0;  ///< above zero: fast
    std::vector<Step> steps;     ///< sorted by time
    bool operator==(const Config&) const = default;
  };

  /// Larger than the drift of any real clock. The clock must not stop, because truth() needs the inverse.
  static constexpr std::int64_t kMaxDriftPpb = 100'000'000;
  /// Ten years: all sums stay far within 64 bits.
  static constexpr Duration kMaxOffset = std::chrono::hours(24 * 3650);
  static constexpr std::size_t kMaxSteps = 1000;

  DriftingClock() = default;
  /// Throws std::invalid_argument for values beyond the limits or unsorted steps.
  explicit DriftingClock(Config config, LocalTime start = {});

  /// The peer's local time. `truth` must be within ±70 years of start.
  LocalTime reading(LocalTime truth) const noexcept;

  /// Returns the first true time, from `from` on, at which the clock reads `reading` or later, which is when a timer of
  /// the peer expires. (A clock that is set back has some readings twice.)
  LocalTime truth(LocalTime reading, LocalTime from = LocalTime::min()) const noexcept;

 private:
  Config config_;
  LocalTime start_{};
};

}  // namespace tendon::injector
