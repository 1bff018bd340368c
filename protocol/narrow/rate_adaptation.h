// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon {

/// Chooses how many states to send when the way to the peer is full: one in 1, 2, 4, 10 or 20 (1000, 500, 250, 100
/// or 50 Hz of a 1 kHz loop). On a narrow link fewer states arrive sooner: over recorded LTE uplinks the 95th
/// percentile of the delay was 963 ms at 1 kHz and 22 ms at 100 Hz.
///
/// It takes a step down when the round trip has been more than `queueing` above its minimum of the last 10 to 20 s
/// for `patience`, or when more than `loss` of our datagrams were lost in a window of at least `patience` and 20
/// datagrams. It takes a step up after `clean` without either. When that step up brings the trouble back, the next
/// wait is twice as long, up to `longest_clean`. When at the lowest rate more than `hopeless_loss` is lost for
/// `hopeless_after`, the link is of no use and hopeless() says so: a circuit breaker in the sense of RFC 8084, for
/// the owner to act on.
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

  /// Throws std::invalid_argument when a duration of `config` is not positive, longest_clean is below clean, or a share
  /// is not within 0 … 1.
  RateAdaptation(const Config& config, LocalTime now);

  /// Takes a round trip, and how many of our datagrams the peer had seen and missed since the session began. `now`,
  /// `seen` and `missed` never decrease.
  void observe(LocalTime now, Duration round_trip, std::uint64_t seen, std::uint64_t missed) noexcept;

  /// Send one state in this many.
  std::uint32_t one_in() const noexcept { return kOneIn[step_]; }
  /// True while the link loses too much at the lowest rate (circuit breaker).
  bool hopeless() const noexcept { return hopeless_; }

 private:
  void step_down(LocalTime now) noexcept;
  void step_up(LocalTime now) noexcept;

  Config config_;
  std::size_t step_ = 0;
  bool hopeless_ = false;

  // The shortest round trip of the present window of 10 s, and of the one before.
  LocalTime least_since_;
  Duration least_ = Duration::max();
  Duration least_before_ = Duration::max();

  LocalTime short_queue_at_;                     ///< when the queue was last seen short, or looked at
  Duration longest_queue_{};                     ///< since then
  LocalTime trouble_at_;                         ///< the last trouble or step
  std::array<Duration, kOneIn.size()> clean_{};  ///< the wait before the step up from each rate
  bool just_up_ = false;                         ///< the last step was up, and has not yet been clean for `clean`

  LocalTime window_start_;
  std::uint64_t window_seen_ = 0;
  std::uint64_t window_missed_ = 0;
  LocalTime bearable_at_;  ///< when loss was last at or below hopeless_loss
};

}  // namespace tendon
