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

/// One direction of one link of a recorded network, once more: each datagram meets the fate of a recorded one. Which
/// one:
///
///     kIndex   datagram i meets the fate of datagram i: the same packets are lost. For the same traffic again, and for
///              traces that shrink.h made
///     kTime    a datagram that arrives at `start` + t meets the fate of the newest one recorded at or before the
///     trace's
///              start + t (before the first: of the first): the network is bad at the same times, however many
///              datagrams there are. For other traffic through the same network
///
/// The fate is the record's, moved in time: what took 20 ms then takes 20 ms now. The same arrivals as in the record
/// so give the same decisions, in every bit (by time: when no two of a flow arrive in the same nanosecond). When the
/// arrivals are others, releases still keep the order in which they came, if in the record they did: release =
/// max(release of the one ahead that passed, arrival + recorded delay).
///
/// What the trace does not hold:
/// * A datagram of a sparse trace that is not listed takes TraceHeader::benign (or no time, where it says nothing of
///   this direction), cause kReplay, and does not overtake the one ahead.
/// * One that is missing in any other trace (a gap in the indices) takes the median delay of those that passed.
/// * After its end a trace that is not sparse begins again, as files of Mahimahi do: by index after the last one, by
/// time
///   after the last one and the mean distance between two.
/// * A link that is not in it gets one that is: of n links, taken in order, link i gets the (i modulo n)th. So many
///   clients can share one imported trace.
/// * A direction that is not in it at all passes without delay.
///
/// Thread-safe: no.
class TracePlayer final : public Decider {
 public:
  enum class By : std::uint8_t { kIndex, kTime };

  /// `start` is when the trace's start is now; by index it does not matter. The player keeps a copy of what it needs.
  /// Throws std::invalid_argument for a sparse trace by time: it says nothing about the time between its datagrams.
  TracePlayer(const Trace& trace, Direction direction, std::uint32_t link, By by, LocalTime start = {});

  Decision decide(const Packet& packet) override;

 private:
  struct Found {
    const TraceRecord* record = nullptr;
    std::uint64_t cycle = 0;  ///< how often the trace has begun again before it
  };
  Found find_by_index(std::uint64_t index);
  Found find_by_time(LocalTime arrival) const;

  By by_;
  LocalTime start_;
  LocalTime recorded_start_;
  std::vector<TraceRecord> records_;  ///< of this flow, by index
  Duration benign_{};
  bool wraps_;
  bool in_order_ = true;
  std::uint64_t length_ = 0;  ///< by index: after so many it begins again
  Duration period_{};         ///< by time
  std::uint64_t next_index_ = 0;
  std::size_t cursor_ = 0;  ///< of the record that the last index found, or the first after it
  LocalTime last_release_ = LocalTime::min();
  std::uint32_t rebinds_ = 0;
};

/// The median delay of the datagrams of one direction that passed, over all its links (the lower one of two); zero when
/// none did.
Duration median_delay(const Trace& trace, Direction direction);

}  // namespace tendon::injector
