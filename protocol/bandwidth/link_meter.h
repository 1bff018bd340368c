// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/estimation/clock_offset_estimator.h"
#include "protocol/messages.h"

namespace tendon {

/// Measures quantiles of the delays of a link, and the longest silence, since the last report.
///
///     round trip = (T4 − T1) − (T3 − T2)      to the peer = T2 − θ − T1      from the peer = T4 − (T3 − θ)
///
/// θ is the estimated offset of the peer's clock. An error of θ changes the one-way delays by opposite amounts. Keeps
/// up to 1024 samples of each delay by dropping every other sample if necessary. Only the constructor allocates memory.
/// Thread-safe: no. Realtime-safe: yes, except report().
class LinkMeter {
 public:
  explicit LinkMeter(LocalTime now) : heard_(now) {}

  /// Must be called for each valid datagram of the peer.
  void heard(LocalTime now) noexcept;
  /// Must be called for each echo. `clock` relates the peer's clock to ours.
  void observe(const ClockExchange& exchange, const ClockOffsetEstimator::Estimate& clock) noexcept;

  struct Report {
    std::optional<Delays> round_trip;
    std::optional<Delays> to_peer;
    std::optional<Delays> from_peer;
    Duration longest_gap{};  ///< including the present silence
  };
  Report report(LocalTime now);

 private:
  class Samples {
   public:
    Samples() { kept_.reserve(kMost); }
    void add(Duration sample) noexcept;
    std::optional<Delays> take();

   private:
    static constexpr std::size_t kMost = 1024;  ///< one second at 1 kHz
    std::vector<Duration> kept_;
    std::uint64_t seen_ = 0;
    std::uint64_t one_in_ = 1;
  };

  LocalTime heard_;
  Duration longest_gap_{};
  std::optional<LocalTime> newest_sent_;  ///< T1 of the newest exchange
  Samples round_trip_;
  Samples to_peer_;
  Samples from_peer_;
};

}  // namespace tendon
