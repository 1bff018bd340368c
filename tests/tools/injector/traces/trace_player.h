// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

/// Replays one direction of one link of a recorded network. Each datagram gets the fate of a recorded one:
///
///     kIndex   datagram i gets the fate of datagram i, so the same packets are lost. Use this for the same traffic and
///              for traces of shrink.h.
///     kTime    a datagram that arrives at `start` + t gets the fate of the newest record at or before the trace's
///              start + t, or of the first record if there is none. Use this for other traffic.
///
/// The fate is shifted in time, but its delay is not changed. The same arrivals give bitwise identical decisions (by
/// time: if no two arrivals of a flow coincide in the same nanosecond). For other arrivals, releases remain in order if
/// they were in order in the record: release = max(release of the predecessor that passed, arrival + recorded delay).
///
/// Datagrams without a record:
/// * In a sparse trace, an unlisted datagram takes TraceHeader::benign (or no time if that is not given for the
///   direction), has the cause kReplay and does not overtake its predecessor.
/// * In any other trace, a missing datagram (a gap in the indices) takes the median delay of those that passed.
/// * After its end, a trace that is not sparse repeats, like Mahimahi's files (kRepeat), or datagrams pass without delay,
///   but not ahead of a predecessor in a trace in order (kPass), or the run ends with the first such datagram (kStop).
///   By index, the end is the last record of the flow, by time the last record of all plus the mean interval.
/// * Of n links in the trace, link i uses the (i modulo n)-th, so that many clients can share an imported trace.
/// * A direction that is not in the trace passes without delay.
///
/// With add(), datagrams pass through a network after the trace:
///
///     trace      t₁, lost₁ as above
///     network    t₂, lost₂ of an Injector with its own random numbers, where the datagram arrives at t₁
///     result     release t₂, lost if lost₁ or lost₂; the cause of the first loss, or else of the last delay
///
/// The total delay is the sum of both delays. FIFO order in the network is based on t₁. The network also gets the
/// datagrams that the trace loses, at the latest t₁ so far, so that these losses do not change its draws. If the trace
/// reorders datagrams (see reorders()), the network needs order=free, because FIFO would restore their order. If trace
/// and network both have a second copy, a stale replay or a flipped bit, the trace's is used. The shorter truncation is
/// used, and the changes of the source port are added.
///
/// Thread-safe: no.
class TracePlayer final : public Decider {
 public:
  enum class By : std::uint8_t { kIndex, kTime };
  enum class AtEnd : std::uint8_t { kRepeat, kStop, kPass };

  /// `start` corresponds to the trace's start; unused by index. Throws std::invalid_argument if a sparse trace is
  /// replayed by time.
  TracePlayer(const Trace& trace, Direction direction, std::uint32_t link, By by, LocalTime start = {},
              AtEnd at_end = AtEnd::kRepeat);

  /// Call it before the first decision. `network` must be of the same direction and link.
  void add(Injector network);

  Decision decide(const Packet& packet) override;

  /// Returns true with kStop if a datagram that arrives at `arrival` is after the end of the trace.
  bool stops(LocalTime arrival) const;

  /// Returns the number of repetitions so far, for example 3.5. By index, this is the number of datagrams divided by
  /// the length of the flow; by time, the time of the last arrival divided by the period. At most 1 without kRepeat; 0
  /// for a sparse trace and for a direction that is not in the trace.
  double played() const;

  /// False if datagrams of this flow overtake each other.
  bool in_order() const { return in_order_; }

 private:
  struct Found {
    const TraceRecord* record = nullptr;
    std::uint64_t cycle = 0;  ///< previous repetitions of the trace
  };
  Found find_by_index(std::uint64_t index);
  Found find_by_time(LocalTime arrival) const;
  bool ended(LocalTime arrival) const;
  Decision of_trace(const Packet& packet);
  Decision through_network(Decision of_trace, const Packet& packet);

  By by_;
  LocalTime start_;
  LocalTime recorded_start_;
  std::vector<TraceRecord> records_;  ///< of this flow, by index
  Duration benign_{};
  AtEnd at_end_;
  bool wraps_;
  bool in_order_ = true;
  std::uint64_t length_ = 0;  ///< the number of indices in the trace
  Duration period_{};         ///< by time
  std::uint64_t next_index_ = 0;
  std::size_t cursor_ = 0;  ///< the record at or after the last index
  LocalTime last_release_ = LocalTime::min();
  std::uint32_t rebinds_ = 0;
  LocalTime last_arrival_{};
  std::optional<Injector> network_;
  LocalTime last_entry_ = LocalTime::min();  ///< latest t₁ so far
};

/// How a trace is replayed.
struct Playback {
  TracePlayer::By by = TracePlayer::By::kIndex;
  TracePlayer::AtEnd at_end = TracePlayer::AtEnd::kRepeat;
  bool add = false;  ///< a network follows the trace
};

/// True if datagrams overtake each other in any flow of this direction.
bool reorders(const Trace& trace, Direction direction);

/// Returns the median delay (lower of two) of the datagrams that passed, over all links; zero if none passed.
Duration median_delay(const Trace& trace, Direction direction);

}  // namespace tendon::injector
