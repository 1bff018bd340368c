// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>

#include "core/base/time.h"

namespace tendon {

/// Computes from the age of the newest state whether the link to the peer still works. The limit v is the maximum of 3
/// periods of the peer, 20 ms, and twice the longest gap between two states in the last 5 to 10 s:
///     age ≤ v            fresh
///     age > v + 20 ms    silent
///     age > v + 250 ms   gone
/// If `late` is true, the result is silent and gone for every age.
/// Thread-safe: no. Realtime-safe: yes.
class LossStages {
 public:
  static constexpr Duration kStale = std::chrono::milliseconds(20);  ///< minimum of v, and the time from v to silent
  static constexpr Duration kLostAfter = std::chrono::milliseconds(250);
  static constexpr Duration kMostGap = std::chrono::milliseconds(100);  ///< maximum value of a gap
  static constexpr Duration kGapsKept = std::chrono::seconds(5);

  struct Stage {
    bool fresh = false;
    bool silent = false;
    bool gone = false;
  };

  explicit LossStages(Duration peer_period) : peer_period_(peer_period) {}

  /// If `counts` is false, the gap to the previous state is ignored.
  void receive(LocalTime now, bool counts) noexcept {
    if (counts) {
      if (now - stretch_began_ >= kGapsKept) {
        stretch_began_ = now;
        before_ = std::exchange(gap_, Duration::zero());
      }
      gap_ = std::max(gap_, std::min(now - arrived_, kMostGap));
    }
    arrived_ = now;
  }

  void forget(LocalTime now) noexcept {
    gap_ = before_ = Duration::zero();
    stretch_began_ = now;
  }

  /// `heard` is false if no state was received.
  Stage at(LocalTime now, bool heard, bool late) const noexcept {
    const Duration age = heard ? now - arrived_ : Duration::max();
    return {.fresh = !late && age <= patience(),
            .silent = late || age > patience() + kStale,
            .gone = late || age > patience() + kLostAfter};
  }

  /// The limit v.
  Duration patience() const noexcept { return std::max({kStale, 3 * peer_period_, 2 * std::max(gap_, before_)}); }

 private:
  Duration peer_period_;
  LocalTime arrived_{};
  Duration gap_{};     ///< longest gap in the current interval
  Duration before_{};  ///< longest gap in the previous interval
  LocalTime stretch_began_{};
};

}  // namespace tendon
