// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/base/time.h"

namespace tendon {

/// Computes the time of the sender to play out, late enough that the messages for that time have arrived:
///     τ = t − min delay − D,      D = p99 of (delay + wait for a gap) − min delay,   0 ≤ D ≤ max_playout
/// t is the local time and τ the time of the sender. A delay is the local arrival time minus the sending time; the
/// offset of the clocks cancels. Both statistics use the last 256 to 512 messages. If the clock rates differ by 200
/// ppm, this shifts τ by less than 0.1 ms at 1 kHz. τ does not jump. Its rate is 1 + (lag / 250 ms), in [0, 2].
///
/// τ does not pass the newest message. If messages arrive in a burst that is longer than D, τ stops until the burst
/// arrives, and continues at the same place. Nothing is skipped, so that an integral and its energy remain consistent.
/// If τ is max_playout behind (t − min delay), it continues without messages.
///
/// Source: playout buffers for voice over packet networks; the quantile, the gaps and the rate control are ours.
/// Thread-safe: no. Realtime-safe: yes.
class PlayoutClock {
 public:
  /// `max_playout` is the maximum of D, ≥ 0. Messages that arrive later are played out late.
  explicit PlayoutClock(Duration max_playout) : max_playout_(max_playout) {}

  /// Records a message with the highest `time` so far, which arrived at the local time `now`. `waited` (≥ 0) is the
  /// additional delay of the playout due to missing previous messages (lost, reordered or not sent).
  void heard(Duration now, Duration time, Duration waited) noexcept;

  /// Returns τ, or 0 if no message was recorded yet. `now` must not decrease.
  Duration advance(Duration now) noexcept;

  Duration playout() const noexcept;  ///< current D

 private:
  static constexpr double kSteering = 0.25;   ///< s
  static constexpr int kHalf = 256;           ///< messages
  static constexpr std::size_t kLargest = 6;  ///< 1 % of two intervals, plus one
  struct Half {
    int count = 0;
    Duration least = Duration::max();          ///< minimum delay
    std::array<Duration, kLargest> largest{};  ///< delay plus wait, in decreasing order
  };

  Duration least() const noexcept;

  Duration max_playout_;
  std::array<Half, 2> halves_{};  ///< current and previous interval
  Duration now_{};
  Duration newest_{};   ///< The time of the newest message.
  Duration playing_{};  ///< τ
  bool started_ = false;
};

}  // namespace tendon
