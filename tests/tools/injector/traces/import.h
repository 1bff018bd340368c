// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

// Measured networks as traces for TracePlayer. They are usually played by time, because measurements are sparser than
// the traffic; each then applies to all datagrams until the next.
//
// All functions throw std::runtime_error, which names the input `name`: "ping.txt:12: …". Causes are kDelay and kLoss,
// link is 0, times begin at 0. Input beyond kMaxTraceRecords is rejected.
//
// Mahimahi's packet-delivery files describe sending opportunities and are part of a profile, opportunities(FILE).

enum class Share : std::uint8_t {
  kHalves,    ///< half of a round trip for each direction (up the smaller one, by at most a nanosecond)
  kUp,        ///< the delay from client to server; the other direction has no delay
  kDown,      ///< the delay from server to client
  kBoth,      ///< a one-way delay, the same for each direction
  kMeasured,  ///< the file contains one delay for each direction (irtt only)
};

struct ImportOptions {
  Share share = Share::kHalves;
  /// Used if the file has no times. Above zero.
  Duration interval = std::chrono::seconds(1);
};

/// Output of ping(8) of iputils or busybox, with or without -D (time stamps), -O ("no answer yet") and names. Gaps in
/// icmp_seq and requests after the last answer are losses. Sending times come from -D if available (evenly between
/// neighbors for lost requests), otherwise from icmp_seq and the interval in the summary ("time 1024857ms") or
/// options.interval. Ignores second answers (DUP!). The direction of a loss is unknown; with kHalves it counts as up,
/// so that it is not counted twice.
///
/// The unit of a time can be ms, us or s. A time can have a decimal point or a decimal comma, and a thousands separator
/// if it has both signs. Throws if the meaning of a comma is ambiguous, if the log contains no answer, and for
/// Share::kMeasured.
Trace import_ping(std::istream& from, const std::string& name, const ImportOptions& options);

/// The JSON file of `irtt client -o FILE.json` (not gzipped). kMeasured uses delay.send and delay.receive, which are
/// valid only if the clocks were synchronized (PTP, GPS); throws if one of them is negative. Other shares use
/// delay.rtt, from which irtt has subtracted the server's own time. "true_up" is a loss up, "true_down" a loss down;
/// "true" is unknown and counts as up.
Trace import_irtt(std::istream& from, const std::string& name, const ImportOptions& options);

/// Reads open_delays(). Sending times t_ms must not decrease; without this column they are options.interval apart. The
/// column dir replaces the share, as in a file from write_delays(); without it, times are shifted to begin at 0.
Trace import_csv(std::istream& from, const std::string& name, const ImportOptions& options);

/// Sent `at` after the first; an empty round trip is a loss.
struct MeasuredRoundTrip {
  Duration at{};
  std::optional<Duration> round_trip;
  std::uint32_t size = 0;
};
/// A trace of round trips. `options.interval` is not used.
Trace import_round_trips(const std::vector<MeasuredRoundTrip>& trips, const std::string& name,
                         const ImportOptions& options);

/// For each direction: number of datagrams and losses, first and last time, minimum, median and maximum delay.
std::string import_summary(const Trace& trace);

/// The log of mm-link with --uplink-log or --downlink-log (mahimahi 0.98 or later): each departure ("MS - BYTES
/// DELAY_MS") is a datagram, each drop ("MS d PACKETS BYTES") is PACKETS lost ones. Resolution of 1 ms. Share is kUp,
/// kDown or kBoth.
Trace import_mahimahi_log(std::istream& from, const std::string& name, const ImportOptions& options);

}  // namespace tendon::injector
