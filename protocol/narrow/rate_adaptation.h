// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// How often states should leave when the way to the peer is full: one in 1, 2, 4, 10 or 20 of them (1000, 500, 250,
/// 100, 50 Hz of a 1 kHz loop). On a narrow link fewer states arrive sooner: over recorded LTE uplinks the 95th
/// percentile of the delay was 963 ms at 1 kHz and 22 ms at 100 Hz.
///
/// A step down when the round trip has been `queueing` above its least of the last 10 to 20 s for `patience`, or when
/// more than `loss` of our datagrams were lost in a window of `patience` and at least 20 datagrams. A step up after
/// `clean` without either; when that brought the trouble back, the next wait is twice as long, at most `longest_clean`.
/// On the lowest rate, with more than `hopeless_loss` lost for `hopeless_after`, the link is of no use: a circuit
/// breaker in the sense of RFC 8084, for the owner to act on.
///
/// Source: RFC 8085 (a sender of UDP must not overload the path), network.md section 2.
///
/// Thread-safe: no. Realtime-safe: yes.
class RateAdaptation {
 public:
  struct Config {
    Duration queueing = std::chrono::milliseconds(10);
    Duration patience = std::chrono::milliseconds(200);
    double loss = 0.05;
    Duration clean = std::chrono::seconds(5);
    Duration longest_clean = std::chrono::seconds(80);
    double hopeless_loss = 0.10;
    Duration hopeless_after = std::chrono::seconds(2);
  };
  static constexpr std::array<std::uint32_t, 5> kOneIn = {1, 2, 4, 10, 20};

  /// Throws std::invalid_argument when a duration of `config` is not positive or a share not within 0 … 1.
  RateAdaptation(const Config& config, LocalTime now);

  /// What an answer of the peer has told: its round trip, and how many of our datagrams it had seen or missed since the
  /// beginning. `now` does not go back, `seen` and `missed` do not shrink.
  void observe(LocalTime now, Duration round_trip, std::uint64_t seen, std::uint64_t missed) noexcept;

  /// One state in so many.
  std::uint32_t one_in() const noexcept { return kOneIn[step_]; }
  /// The circuit breaker.
  bool hopeless() const noexcept { return hopeless_; }

 private:
  void step_down(LocalTime now) noexcept;
  void step_up(LocalTime now) noexcept;

  Config config_;
  std::size_t step_ = 0;
  bool hopeless_ = false;

  // The least round trip of the present 10 s, and of the 10 s before.
  LocalTime least_since_;
  Duration least_ = Duration::max();
  Duration least_before_ = Duration::max();

  LocalTime short_queue_at_;                     ///< when the queue was last seen short, or looked at
  Duration longest_queue_{};                     ///< since then
  LocalTime trouble_at_;                         ///< when there last was any, or a step was taken
  std::array<Duration, kOneIn.size()> clean_{};  ///< wait for the step up from each
  bool just_up_ = false;                         ///< the last step was up, and has not yet been clean for `clean`

  LocalTime window_start_;
  std::uint64_t window_seen_ = 0;
  std::uint64_t window_missed_ = 0;
  LocalTime bearable_at_;  ///< when loss was last at or below hopeless_loss
};

}  // namespace tendon
