// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace tendon {

/// One question and its answer, with the four time stamps of NTP (RFC 5905).
struct ClockExchange {
  LocalTime sent;         ///< T1, we asked
  PeerTime received;      ///< T2, the peer heard it
  PeerTime answered;      ///< T3, the peer answered; ≥ T2
  LocalTime answered_at;  ///< T4, we heard that; ≥ T1
};

/// How far the peer's clock is ahead of ours, how fast it drifts, and how wrong that can be at most.
///
/// Both one-way delays of an exchange are unknown but not negative, and the offset θ (peer − ours) drifts by at most ρ.
/// So an exchange bounds θ at its middle:
///
///     θᵢ = ((T2 − T1) + (T3 − T4)) / 2,   δᵢ = (T4 − T1) − (T3 − T2),   |θ(tᵢ) − θᵢ| ≤ (δᵢ + ρ (T4 − T1)) / 2 = eᵢ
///
/// Exchanges with a short round trip δ say most, unless the peer has held its answer for long: the clocks drift all
/// that time, and with a fast peer δ even looks short. Time is cut into blocks; each keeps only its exchange with the
/// least e, and a line is fitted to them with weights 1 / (δ₀ + 2 eᵢ − 2 e_min). The line is then moved into the range
/// that all of them permit at time t:
///
///     maxᵢ (θᵢ − eᵢ − ρ|t − tᵢ|) ≤ θ(t) ≤ minᵢ (θᵢ + eᵢ + ρ|t − tᵢ|)
///
/// Its distance from the farther end is the error bound, which is proved, given ρ. An empty range means that the peer's
/// clock has been set: the past is forgotten, and that is counted in `steps`.
///
/// Blocks of 16 exchanges at 5 Hz, eight of them, were the best of six estimators on three real host pairs
/// (network.md). Here a block is also at least 3.2 s long, so that exchanges at 1 kHz see as much weather.
///
/// Thread-safe: no. Realtime-safe: yes.
class ClockOffsetEstimator {
 public:
  static constexpr std::size_t kBlocks = 8;
  static constexpr int kExchangesPerBlock = 16;
  static constexpr Duration kLeastBlock = std::chrono::milliseconds(3200);
  /// δ₀: differences of round trip below it are the scheduler's, not the path's.
  static constexpr Duration kResolution = std::chrono::microseconds(100);

  struct Estimate {
    Duration offset{};            ///< peer's reading − ours, at the time asked for
    double drift = 0;             ///< s/s, how fast it grows
    Duration error_bound{};       ///< |true offset − offset| ≤ this
    Duration least_round_trip{};  ///< of the exchange that says most

    PeerTime to_peer(LocalTime ours) const noexcept { return PeerTime(ours.time_since_epoch() + offset); }
    LocalTime to_local(PeerTime theirs) const noexcept { return LocalTime(theirs.time_since_epoch() - offset); }
  };

  /// `fastest_drift`: ρ, s/s, of the two clocks against each other; 200 ppm is beyond any quartz. Throws
  /// std::invalid_argument when it is not within 0 … 0.01.
  explicit ClockOffsetEstimator(double fastest_drift = 200e-6);

  /// An exchange that is impossible (T4 < T1, T3 < T2, or a negative round trip beyond what drift explains) changes
  /// nothing. `answered_at` should not go back.
  void observe(const ClockExchange& exchange) noexcept;

  /// At `at`, past or future; empty before the first exchange.
  std::optional<Estimate> estimate(LocalTime at) const noexcept;

  /// How often the peer's clock was seen to be set to another time.
  std::uint64_t steps() const noexcept { return steps_; }

 private:
  struct Sample {
    LocalTime at;             ///< the middle of the exchange on our clock
    std::int64_t offset_ns;   ///< θ
    std::int64_t round_trip;  ///< δ, ns, ≥ 0
    std::int64_t doubt;       ///< 2 e, ns
  };
  struct Interval {
    double low;  ///< ns, from `reference`
    double high;
  };
  std::optional<Sample> sample_of(const ClockExchange& exchange) const noexcept;
  Interval permitted(LocalTime at, std::int64_t reference) const noexcept;
  template <class Visit>
  void for_each(Visit visit) const noexcept;

  double fastest_drift_;
  std::array<Sample, kBlocks> blocks_{};  // a ring of finished blocks
  std::size_t finished_ = 0;              // ever; the newest is blocks_[(finished_ − 1) % kBlocks]
  std::optional<Sample> best_;            // of the block under way
  LocalTime block_started_{};
  int exchanges_ = 0;  // in the block under way
  std::uint64_t steps_ = 0;
};

}  // namespace tendon
