// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/base/time.h"

namespace tendon {

/// Says which moment of a sender to play out now, so late that what belongs to it has come, and no later.
///
///     τ = t − least way − D,      D = p99 of (way + what was waited for a gap) − least way,   0 ≤ D ≤ max_playout
///
/// t is our time, τ the sender's; a way is our time of arrival minus the sender's time of sending. Their zeros differ
/// by anything, which drops out: no clocks are compared. Both figures are of the last 256 to 512 messages, so a rate
/// that is wrong by 200 ppm shifts τ by less than 0.1 ms at 1000 messages a second. τ is brought to a new place
/// without jumps: it runs at 1 + (lag / 100 ms) of its rate, at most twice as fast and never backwards.
///
/// Source: playout buffers of packet voice; the quantile, the gaps and the steering are ours.
///
/// Thread-safe: no. Realtime-safe: yes.
class PlayoutClock {
 public:
  /// `max_playout`: the most that D may be; ≥ 0. What comes later than that is played out of its place.
  explicit PlayoutClock(Duration max_playout) : max_playout_(max_playout) {}

  /// The newest message yet has come at our time `now`, sent at its `time`. `waited` (≥ 0): how much longer than its
  /// own way those before it that have not come (lost, overtaken or never sent) made the playout wait.
  void heard(Duration now, Duration time, Duration waited) noexcept;

  /// Our time is now `now`, and does not fall. Returns τ. Before anything was heard τ stays at zero.
  Duration advance(Duration now) noexcept;

  /// D, as it would be now.
  Duration playout() const noexcept;

 private:
  static constexpr int kHalf = 256;           ///< messages
  static constexpr std::size_t kLargest = 6;  ///< 1 % of two halves and one
  struct Half {
    int count = 0;
    Duration least = Duration::max();          ///< way
    std::array<Duration, kLargest> largest{};  ///< way and wait, falling
  };

  Duration least() const noexcept;

  Duration max_playout_;
  std::array<Half, 2> halves_{};  ///< the one that is being filled, and the one before
  Duration now_{};
  Duration playing_{};  ///< τ
  bool started_ = false;
};

}  // namespace tendon
