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
  LocalTime sent;         ///< T1, question sent
  PeerTime received;      ///< T2, question received by the peer
  PeerTime answered;      ///< T3, answer sent by the peer; ≥ T2
  LocalTime answered_at;  ///< T4, answer received; ≥ T1
};

/// Estimates the offset and drift of the clock of the peer, and an error bound of the offset. One-way delays are
/// unknown but not negative, and the offset θ (peer − local) drifts by at most ρ. At the midpoint of an exchange
///     θᵢ = ((T2 − T1) + (T3 − T4)) / 2,   δᵢ = (T4 − T1) − (T3 − T2),   |θ(tᵢ) − θᵢ| ≤ (δᵢ + ρ (T4 − T1)) / 2 = eᵢ
/// Time is divided into blocks. The exchange with the smallest e is used for each block. A line is fitted to these with
/// the weights 1 / (δ₀ + 2 eᵢ − 2 e_min). The line is then moved into the range that all of them allow at time t:
///     maxᵢ (θᵢ − eᵢ − ρ|t − tᵢ|) ≤ θ(t) ≤ minᵢ (θᵢ + eᵢ + ρ|t − tᵢ|)
/// The error bound is the distance to the farther end of this range. It is proved for a given ρ (core/PROOFS.md, "Clock
/// offset"). If the range is empty, the clock of the peer was set. Then, `steps` is increased and all data is
/// discarded.
///
/// A block has at least 16 exchanges and 3.2 s. This was the best of six estimators in measurements at 5 Hz between
/// three pairs of hosts, with eight blocks.
/// Thread-safe: no. Realtime-safe: yes.
class ClockOffsetEstimator {
 public:
  static constexpr std::size_t kBlocks = 8;
  static constexpr int kExchangesPerBlock = 16;
  static constexpr Duration kLeastBlock = std::chrono::milliseconds(3200);
  /// δ₀. Smaller differences in the round trip are caused by the scheduler and not by the path.
  static constexpr Duration kResolution = std::chrono::microseconds(100);

  struct Estimate {
    Duration offset{};            ///< clock of the peer − local clock, at the requested time
    double drift = 0;             ///< s/s, rate of change of the offset
    Duration error_bound{};       ///< |true offset − offset| ≤ this
    Duration least_round_trip{};  ///< the round trip of the exchange with the smallest error bound

    PeerTime to_peer(LocalTime ours) const noexcept { return PeerTime(ours.time_since_epoch() + offset); }
    LocalTime to_local(PeerTime theirs) const noexcept { return LocalTime(theirs.time_since_epoch() - offset); }
  };

  /// `fastest_drift` is ρ in s/s. The default exceeds that of a quartz. Throws std::invalid_argument if not in 0 …
  /// 0.01.
  explicit ClockOffsetEstimator(double fastest_drift = 200e-6);

  /// Ignores T4 < T1, T3 < T2, and a negative round trip that exceeds the drift. `answered_at` should not decrease.
  void observe(const ClockExchange& exchange) noexcept;

  /// `at` can be in the past or future. Empty before the first exchange.
  std::optional<Estimate> estimate(LocalTime at) const noexcept;

  std::uint64_t steps() const noexcept { return steps_; }  ///< times that the peer's clock was set

 private:
  struct Sample {
    LocalTime at;             ///< local time of the midpoint of the exchange
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
  std::size_t finished_ = 0;              // total; the newest is blocks_[(finished_ − 1) % kBlocks]
  std::optional<Sample> best_;            // of the current block
  LocalTime block_started_{};
  int exchanges_ = 0;  // in the current block
  std::uint64_t steps_ = 0;
};

}  // namespace tendon
