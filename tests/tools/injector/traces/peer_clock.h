// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/time.h"

namespace tendon::injector {

/// The clock of another machine, with all that is wrong with it: for simulated worlds, in which every peer should have
/// one, because nothing that compares two clocks may work by their being one. What it reads at the true time t is
///
///     reading(t) = t + offset + ⌊(t − start) · drift_ppb / 10⁹⌋ + Σ change of the steps with start + at ≤ t
///
/// in whole nanoseconds, without floating point. Real machines differ by any offset (since their boot), drift by up to
/// 100 ppm (10⁵ ppb; quartz; 16 ppm was measured between two hosts), and step when somebody sets them; a monotonic clock
/// does not step, but one that a virtual machine was resumed with does.
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
    std::vector<Step> steps;     ///< rising in time
    bool operator==(const Config&) const = default;
  };

  /// 10 %: what no clock does, and still far from one that stands still, which could not be read backwards.
  static constexpr std::int64_t kMaxDriftPpb = 100'000'000;
  /// Ten years: sums of all there is stay far within 64 bits.
  static constexpr Duration kMaxOffset = std::chrono::hours(24 * 3650);
  static constexpr std::size_t kMaxSteps = 1000;

  /// A clock without faults.
  DriftingClock() = default;
  /// Throws std::invalid_argument when something is beyond the limits, or the steps are not rising in time.
  explicit DriftingClock(Config config, LocalTime start = {});

  /// What the peer calls its local time. `truth` within ±70 years of start.
  LocalTime reading(LocalTime truth) const noexcept;

  /// The first true time, from `from` on, at which the clock reads `reading` or later: when a timer of the peer rings.
  /// (A clock that is set back reads everything in between twice.)
  LocalTime truth(LocalTime reading, LocalTime from = LocalTime::min()) const noexcept;

 private:
  Config config_;
  LocalTime start_{};
};

}  // namespace tendon::injector
