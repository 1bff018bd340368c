// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Reduces the rate of states when the path to the peer is congested: one state in 1, 2, 4, 10 or 20 is sent (1000,
/// 500, 250, 100 or 50 Hz of a 1 kHz loop). On a narrow link, fewer states arrive sooner: over recorded LTE uplinks the
/// 95th percentile of the delay was 963 ms at 1 kHz and 22 ms at 100 Hz.
///
/// The rate goes down one step if the round trip has exceeded its minimum of the last 10 to 20 s by more than
/// `queueing` for `patience`, or if more than `loss` of our datagrams were lost in a window of at least `patience` and
/// 20 datagrams. It goes up one step after `clean` without either. If the congestion then returns, the next wait is
/// twice as long, up to `longest_clean`. If more than `hopeless_loss` is lost at the lowest rate for `hopeless_after`,
/// the link is unusable and hopeless() returns true. This is a circuit breaker in the sense of RFC 8084, on which the
/// owner must act.
///
/// Source: RFC 8085 (a sender of UDP must not overload the path).
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

  /// Throws std::invalid_argument if a duration of `config` is not positive, if longest_clean is below clean, or if a
  /// share is not within 0 … 1.
  RateAdaptation(const Config& config, LocalTime now);

  /// Adds a round trip and the numbers of our datagrams that the peer has seen and missed since the session began.
  /// `now`, `seen` and `missed` must not decrease.
  void observe(LocalTime now, Duration round_trip, std::uint64_t seen, std::uint64_t missed) noexcept;

  /// The server should send one state in this many.
  std::uint32_t one_in() const noexcept { return kOneIn[step_]; }
  /// True while the loss at the lowest rate is too high (circuit breaker).
  bool hopeless() const noexcept { return hopeless_; }

 private:
  void step_down(LocalTime now) noexcept;
  void step_up(LocalTime now) noexcept;

  Config config_;
  std::size_t step_ = 0;
  bool hopeless_ = false;

  // Shortest round trips of the present window of 10 s and of the window before it.
  LocalTime least_since_;
  Duration least_ = Duration::max();
  Duration least_before_ = Duration::max();

  LocalTime short_queue_at_;                     ///< time of the last short queue, or of the last decision
  Duration longest_queue_{};                     ///< longest queue since then
  LocalTime trouble_at_;                         ///< time of the last congestion or rate change
  std::array<Duration, kOneIn.size()> clean_{};  ///< for each rate, how long to wait before the rate goes up
  bool just_up_ = false;                         ///< the last change was up, and it is not yet confirmed by `clean`

  LocalTime window_start_;
  std::uint64_t window_seen_ = 0;
  std::uint64_t window_missed_ = 0;
  LocalTime bearable_at_;  ///< last time at which the loss was at most hopeless_loss
};

}  // namespace tendon
