// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/import_capture.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tests/tools/injector/profile/units.h"

namespace tendon::injector {
namespace {

constexpr double kMostRepeated = 0.01;
constexpr Duration kLongestEcho = std::chrono::hours(24);

std::string counted(std::size_t count, std::string_view what) {
  return std::to_string(count) + ' ' + std::string(what) + (count == 1 ? "" : "s");
}

/// A datagram of one direction.
struct Sent {
  Duration at{};  ///< on the client's clock
  std::uint64_t hash = 0;
  std::uint32_t size = 0;
};

/// A direction of the network: the near tap records what is sent, and the far tap what arrives.
struct Path {
  Direction direction;
  const Tap& near;
  const Tap& far;
  std::uint16_t near_port = 0;
  std::uint16_t far_port = 0;
  Duration near_offset;  ///< added to the near tap's times to get the client's clock
  Duration far_offset;
};

std::vector<Sent> datagrams(const Capture& capture, Direction direction, std::uint16_t port, Duration offset) {
  std::vector<Sent> found;
  for (const CapturedDatagram& one : capture.datagrams) {
    const std::uint16_t end = direction == Direction::kUp ? one.destination : one.source;
    if (end == port) found.push_back({one.at + offset, one.payload_hash, one.size});
  }
  std::ranges::stable_sort(found, {}, &Sent::at);  // a tap with several queues can write them out of order
  return found;
}

void refuse_cut(const Tap& tap, std::uint16_t port) {
  const auto cut = std::ranges::count_if(tap.capture.datagrams, [port](const CapturedDatagram& one) {
    return one.cut && (one.destination == port || one.source == port);
  });
  if (cut == 0) return;
  throw std::runtime_error(tap.name + ": the snapshot length cuts " +
                           counted(static_cast<std::size_t>(cut), "datagram") +
                           ", so that payloads cannot be matched; expected a capture with tcpdump -s 0");
}

void refuse_repeated(const Tap& tap, const std::vector<Sent>& sent) {
  std::unordered_map<std::uint64_t, std::size_t> times;
  std::size_t repeated = 0;
  for (const Sent& one : sent) repeated += times[one.hash]++ > 0 ? 1 : 0;
  if (static_cast<double>(repeated) <= kMostRepeated * static_cast<double>(sent.size())) return;
  throw std::runtime_error(tap.name + ": " + std::to_string(repeated) + " of " + counted(sent.size(), "datagram") +
                           " repeat an earlier payload, expected at most 1 %, because equal payloads cannot be told "
                           "apart");
}

/// The records of one direction, without their indices.
struct Matched {
  std::vector<TraceRecord> records;
  std::size_t unknown = 0;
  std::size_t negative = 0;
  std::size_t matched = 0;
  Duration least = Duration::max();
};

Matched match(const Path& path) {
  const std::vector<Sent> sent = datagrams(path.near.capture, path.direction, path.near_port, path.near_offset);
  const std::vector<Sent> arrived = datagrams(path.far.capture, path.direction, path.far_port, path.far_offset);
  refuse_repeated(path.near, sent);
  std::unordered_map<std::uint64_t, std::vector<Duration>> arrivals;
  for (const Sent& one : arrived) arrivals[one.hash].push_back(one.at);
  std::unordered_map<std::uint64_t, std::size_t> copies;
  for (const Sent& one : sent) ++copies[one.hash];

  Matched result;
  std::unordered_map<std::uint64_t, std::size_t> used;
  Duration longest{};
  for (const Sent& one : sent) {
    TraceRecord record;
    record.direction = path.direction;
    record.arrival = LocalTime(one.at);
    record.size = one.size;
    record.payload_hash = one.hash;
    const std::vector<Duration>& times = arrivals[one.hash];
    const std::size_t next = used[one.hash]++;
    record.verdict = Verdict::kDrop;
    record.cause = Cause::kLoss;
    record.release = record.arrival;
    if (next < times.size()) {
      const Duration delay = times[next] - one.at;
      ++result.matched;
      result.negative += delay < Duration::zero() ? 1 : 0;
      result.least = std::min(result.least, delay);
      longest = std::max(longest, delay);
      record.verdict = Verdict::kPass;
      record.cause = Cause::kDelay;
      record.release = LocalTime(times[next]);
      if (copies[one.hash] == 1 && times.size() > 1) record.duplicate = LocalTime(times[1]);
    }
    result.records.push_back(record);
  }
  const Duration begin = path.far.capture.first.value_or(Duration::max()) + path.far_offset;
  const Duration end = path.far.capture.last.value_or(Duration::min()) + path.far_offset - longest;
  result.unknown = std::erase_if(result.records, [&](const TraceRecord& record) {
    const Duration at = record.arrival.time_since_epoch();
    return record.verdict == Verdict::kDrop && (at < begin || at > end);
  });
  return result;
}

std::string skipped(const Tap& tap) {
  std::string text;
  const Capture& capture = tap.capture;
  if (capture.fragments > 0) text += tap.name + ": skipped " + counted(capture.fragments, "IP fragment") + '\n';
  if (capture.truncated) text += tap.name + ": ends within a packet\n";
  return text;
}

/// Gives each record its index. Times begin at 0.
void number(Trace& trace) {
  std::ranges::stable_sort(trace.records, {}, [](const TraceRecord& r) { return r.arrival; });
  const Duration zero = trace.records.empty() ? Duration{} : trace.records.front().arrival.time_since_epoch();
  std::array<std::uint64_t, 2> next{};
  for (TraceRecord& record : trace.records) {
    if (std::max(record.arrival, record.release).time_since_epoch() - zero > kMaxTraceTime / 2) {
      throw std::runtime_error("expected less than 36 years from the first to the last datagram of both captures");
    }
    record.index = next[static_cast<std::size_t>(record.direction)]++;
    record.arrival -= zero;
    record.release -= zero;
    if (record.duplicate) *record.duplicate -= zero;
  }
  if (trace.records.size() > kMaxTraceRecords) {
    throw std::runtime_error("expected at most " + std::to_string(kMaxTraceRecords) + " datagrams, found more");
  }
}

}  // namespace

TwoTaps import_two_taps(const Tap& client, const Tap& server, const TapOptions& options) {
  const std::uint16_t server_port = options.server_port != 0 ? options.server_port : options.port;
  for (const auto& [tap, port] : {std::pair(&client, options.port), std::pair(&server, server_port)}) {
    refuse_cut(*tap, port);
    if (!datagrams(tap->capture, Direction::kUp, port, {}).empty()) continue;
    if (!datagrams(tap->capture, Direction::kDown, port, {}).empty()) continue;
    throw std::runtime_error(
        tap->name + ": expected UDP datagrams from or to port " + std::to_string(port) + ", found " +
        counted(tap->capture.datagrams.size(), "datagram") + " of other ports and " +
        counted(tap->capture.tcp, "TCP packet") +
        (tap->capture.tcp > 0 ? ", whose delay includes retransmissions and delayed answers" : ""));
  }
  TwoTaps result;
  result.trace.notes.push_back({0, "imported from " + client.name + " and " + server.name});
  std::size_t matched = 0;
  std::size_t negative = 0;
  Duration least = Duration::max();
  for (const Path& path :
       {Path{Direction::kUp, client, server, options.port, server_port, Duration{}, -options.clock_offset},
        Path{Direction::kDown, server, client, server_port, options.port, -options.clock_offset, Duration{}}}) {
    const Matched found = match(path);
    matched += found.matched;
    negative += found.negative;
    least = std::min(least, found.least);
    result.trace.records.insert(result.trace.records.end(), found.records.begin(), found.records.end());
    if (found.unknown > 0) {
      result.summary += (path.direction == Direction::kUp ? "up: " : "down: ") + counted(found.unknown, "datagram") +
                        " left out: the other capture does not cover their arrival\n";
    }
  }
  if (matched == 0) {
    throw std::runtime_error("no payload of " + client.name + " is in " + server.name +
                             ": expected captures of the same datagrams, at the same time and on the same layer, not "
                             "one inside of a tunnel");
  }
  if (negative > 0) {
    const bool swapped = negative * 2 > matched;
    throw std::runtime_error(std::to_string(negative) + " of " + counted(matched, "delay") + " are negative, down to " +
                             duration_text(least) + ": " +
                             (swapped ? "expected the capture at the client first, then the one at the server, or "
                                        "--clock-offset-ms if the clocks of the taps differ"
                                      : "the clocks of the taps differ; expected --clock-offset-ms, or synchronized "
                                        "clocks (PTP)"));
  }
  result.summary += skipped(client) + skipped(server);
  number(result.trace);
  return result;
}

Trace import_echoes(const Tap& tap, const ImportOptions& options) {
  std::map<std::pair<std::uint16_t, std::uint16_t>, std::size_t> open;  // by id and sequence number
  struct Echo {
    Duration at{};
    std::optional<Duration> round_trip;
    std::uint32_t size = 0;
  };
  std::vector<Echo> echoes;
  for (const CapturedEcho& one : tap.capture.echoes) {
    const std::pair key(one.id, one.sequence);
    if (!one.reply) {
      open[key] = echoes.size();
      echoes.push_back({one.at, std::nullopt, one.size});
    } else if (const auto found = open.find(key); found != open.end()) {
      const Duration round_trip = one.at - echoes[found->second].at;
      if (round_trip < Duration::zero()) {
        throw std::runtime_error(tap.name + ": a reply is " + duration_text(-round_trip) +
                                 " earlier than its request; expected a clock that is not set during the capture");
      }
      if (round_trip <= kLongestEcho) echoes[found->second].round_trip = round_trip;
      open.erase(found);  // ignores further replies
    }
  }
  const bool any = std::ranges::any_of(echoes, [](const Echo& one) { return one.round_trip.has_value(); });
  if (!any) {
    throw std::runtime_error(tap.name + ": expected ICMP echo requests and replies at a single tap, found " +
                             counted(echoes.size(), "request") + ", " +
                             counted(tap.capture.datagrams.size(), "UDP datagram") + " and " +
                             counted(tap.capture.tcp, "TCP packet") +
                             ". UDP needs a second capture at the server. The acknowledgments of TCP are delayed, and "
                             "RTP does not contain the delay of the network");
  }
  std::vector<MeasuredRoundTrip> trips;
  Duration longest{};
  for (const Echo& one : echoes) longest = std::max(longest, one.round_trip.value_or(Duration{}));
  const Duration end = tap.capture.last.value() - longest;
  for (const Echo& one : echoes) {
    if (!one.round_trip && one.at > end) continue;  // the answer can be later than the capture
    trips.push_back({one.at - echoes.front().at, one.round_trip, one.size});
  }
  return import_round_trips(trips, tap.name, options);
}

}  // namespace tendon::injector
