// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

// Networks that others measured, as traces for TracePlayer. By time, as a rule: measurements are sparser than the
// traffic they are meant for, and each then speaks for all datagrams until the next. By index they are a list of
// delays.
//
// All import functions name what they read `name` in errors, which are std::runtime_error: "ping.txt:12: …". Causes are
// kDelay and kLoss, link is 0, times begin at 0. Nothing larger than a trace may be is read (kMaxTraceRecords).
//
// Mahimahi's packet-delivery files are no import: they say when the link can send and nothing about packets, so they
// are a part of a profile, opportunities(FILE). The log of a run of mm-link does speak about packets:
// import_mahimahi_log().

/// Whose delay a measured one is.
enum class Share : std::uint8_t {
  kHalves,    ///< of a round trip: half for each direction (up the smaller one of two, by a nanosecond)
  kUp,        ///< all of it of client to server; the way back passes without delay
  kDown,      ///< all of it of server to client
  kBoth,      ///< a one-way delay, the same for each direction
  kMeasured,  ///< the file has one for each direction; irtt only
};

struct ImportOptions {
  Share share = Share::kHalves;
  /// From one measurement to the next, where the file does not say when they were made. Above zero.
  Duration interval = std::chrono::seconds(1);
};

/// What ping(8) of iputils or busybox prints, with or without -D (time stamps), -O ("no answer yet") and names.
/// Gaps in icmp_seq are losses, and so is what was transmitted after the last answer. When the request was sent is
/// taken from -D if it is there (of lost ones: evenly between their neighbours), else it is the icmp_seq-th interval,
/// as the summary's "time 1024857ms" says, or else options.interval. Second answers (DUP!) are left out. Ping cannot
/// tell which way a packet was lost: with kHalves it is the way up, so that loss is not counted twice.
///
/// The unit of a time can be ms, us or s. A time can have a decimal point or a decimal comma, and a thousands separator if
/// it has both signs. The function throws if the meaning of a comma is not clear, if the log contains no answer, and for
/// Share::kMeasured.
Trace import_ping(std::istream& from, const std::string& name, const ImportOptions& options);

/// The JSON file of `irtt client -o FILE.json` (not gzipped). kMeasured takes delay.send and delay.receive, which are
/// true only if the clocks of client and server were synchronised (PTP, GPS): refused when one of them is below zero.
/// All other shares take delay.rtt, from which irtt has subtracted the server's own time. Up is lost what is
/// "true_up", down what is "true_down"; of "true" nobody knows, and it counts as up.
Trace import_irtt(std::istream& from, const std::string& name, const ImportOptions& options);

/// Reads a list of delays with open_delays(). The column t_ms is the time when a datagram was sent. Times must not
/// decrease. Without this column, the interval between datagrams is options.interval. The column dir replaces the share,
/// as in a file from write_delays(). Without this column, the times are shifted to begin at 0.
Trace import_csv(std::istream& from, const std::string& name, const ImportOptions& options);

/// Returns a summary of an imported trace, with one line for each direction. The line contains the number of datagrams
/// and losses, the first and last time, and the minimum, median and maximum delay.
std::string import_summary(const Trace& trace);

/// The log that mm-link writes with --uplink-log or --downlink-log (of mahimahi 0.98 on): each departure
/// ("MS - BYTES DELAY_MS") is a datagram, each drop ("MS d PACKETS BYTES") that many lost ones. In whole milliseconds.
/// Share is kUp, kDown or kBoth.
Trace import_mahimahi_log(std::istream& from, const std::string& name, const ImportOptions& options);

}  // namespace tendon::injector
