// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Reduces the rate of states if the path to the peer is congested, by sending one state in 1, 2, 4, 10 or 20 (1000,
/// 500, 250, 100 or 50 Hz of a 1 kHz loop). For example, reducing the rate over recorded LTE uplinks from 1 kHz to 100
/// Hz reduced the 95th percentile of the delay from 963 ms to 22 ms.
///
/// * Step down: if the round trip has exceeded its minimum of the last 10 to 20 s by `queueing` for `patience`, or if
///   more than `loss` of our datagrams were lost in a window of at least `patience` and 20 datagrams.
/// * Step up: after `clean` without congestion. If congestion returns, the next wait is doubled, up to `longest_clean`.
/// * unusable(): if more than `unusable_loss` is lost at the lowest rate for `unusable_after`. This is a circuit
///   breaker (RFC 8084), and the owner should stop sending.
/// Source: RFC 8085 (a sender of UDP must not overload the path).
/// Thread-safe: no. Realtime-safe: yes.
class RateAdaptation {
 public:
  struct Config {
    Duration queueing = std::chrono::milliseconds(10);
    Duration patience = std::chrono::milliseconds(200);
    double loss = 0.05;
    Duration clean = std::chrono::seconds(5);
    Duration longest_clean = std::chrono::seconds(80);
    double unusable_loss = 0.10;
    Duration unusable_after = std::chrono::seconds(2);
  };
  static constexpr std::array<std::uint32_t, 5> kOneIn = {1, 2, 4, 10, 20};

  /// Throws std::invalid_argument if a duration is not positive, longest_clean < clean, or a share is not in 0 … 1.
  RateAdaptation(const Config& config, LocalTime now);

  /// `seen` and `missed` count our datagrams that the peer has seen and missed. They and `now` must not decrease.
  void observe(LocalTime now, Duration round_trip, std::uint64_t seen, std::uint64_t missed) noexcept;

  std::uint32_t one_in() const noexcept { return kOneIn[step_]; }
  bool unusable() const noexcept { return unusable_; }

 private:
  void step_down(LocalTime now) noexcept;
  void step_up(LocalTime now) noexcept;

  Config config_;
  std::size_t step_ = 0;
  bool unusable_ = false;

  // Minimum round trips of the current and the previous window of 10 s.
  LocalTime least_since_;
  Duration least_ = Duration::max();
  Duration least_before_ = Duration::max();

  LocalTime short_queue_at_;  ///< or of the last decision
  Duration longest_queue_{};
  LocalTime trouble_at_;                         ///< last congestion or step
  std::array<Duration, kOneIn.size()> clean_{};  ///< before stepping up from each rate
  bool just_up_ = false;                         ///< last step was up, and is not yet confirmed

  LocalTime window_start_;
  std::uint64_t window_seen_ = 0;
  std::uint64_t window_missed_ = 0;
  LocalTime bearable_at_;  ///< last time without excessive loss
};

}  // namespace tendon
