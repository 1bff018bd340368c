// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/estimation/clock_offset_estimator.h"
#include "protocol/messages.h"

namespace tendon {

/// What a link did lately: quantiles of its delays, and how long nothing came of it.
///
///     round trip = (T4 − T1) − (T3 − T2)      to the peer = T2 − θ − T1      from the peer = T4 − (T3 − θ)
///
/// with the offset θ of the peer's clock as it is known when the exchange arrives: the two of one way are as wrong as θ
/// is, in opposite directions.
///
/// Of a delay at most 1024 samples are kept; beyond that every second, every fourth … one counts. Takes its memory when
/// it is made.
///
/// Thread-safe: no. Realtime-safe: yes, but for report().
class LinkMeter {
 public:
  explicit LinkMeter(LocalTime now) : heard_(now) {}

  /// A good datagram of the peer has come.
  void heard(LocalTime now) noexcept;
  /// … with an echo. `clock` is the peer's, by ours.
  void observe(const ClockExchange& exchange, const ClockOffsetEstimator::Estimate& clock) noexcept;

  struct Report {
    std::optional<Delays> round_trip;
    std::optional<Delays> to_peer;
    std::optional<Delays> from_peer;
    Duration longest_gap{};  ///< a silence that still lasts counts
  };
  /// Since the last call.
  Report report(LocalTime now);

 private:
  class Samples {
   public:
    Samples() { kept_.reserve(kMost); }
    void add(Duration sample) noexcept;
    /// Empties it.
    std::optional<Delays> take();

   private:
    static constexpr std::size_t kMost = 1024;  ///< of a second at 1 kHz all
    std::vector<Duration> kept_;
    std::uint64_t seen_ = 0;
    std::uint64_t one_in_ = 1;
  };

  LocalTime heard_;
  Duration longest_gap_{};
  std::optional<LocalTime> newest_sent_;  ///< T1 of the newest exchange: the same way there is one sample
  Samples round_trip_;
  Samples to_peer_;
  Samples from_peer_;
};

}  // namespace tendon
