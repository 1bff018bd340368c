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
/// * After its end, a trace that is not sparse repeats, like Mahimahi's files: by index after the last record, by time
///   after the last record plus the mean interval.
/// * Of n links in the trace, link i uses the (i modulo n)-th, so that many clients can share an imported trace.
/// * A direction that is not in the trace passes without delay.
///
/// Thread-safe: no.
class TracePlayer final : public Decider {
 public:
  enum class By : std::uint8_t { kIndex, kTime };

  /// `start` corresponds to the trace's start; unused by index. Throws std::invalid_argument if a sparse trace is
  /// replayed by time.
  TracePlayer(const Trace& trace, Direction direction, std::uint32_t link, By by, LocalTime start = {});

  Decision decide(const Packet& packet) override;

 private:
  struct Found {
    const TraceRecord* record = nullptr;
    std::uint64_t cycle = 0;  ///< previous repetitions of the trace
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
  std::uint64_t length_ = 0;  ///< the number of indices in the trace
  Duration period_{};         ///< by time
  std::uint64_t next_index_ = 0;
  std::size_t cursor_ = 0;  ///< the record at or after the last index
  LocalTime last_release_ = LocalTime::min();
  std::uint32_t rebinds_ = 0;
};

/// Returns the median delay (lower of two) of the datagrams that passed, over all links; zero if none passed.
Duration median_delay(const Trace& trace, Direction direction);

}  // namespace tendon::injector
