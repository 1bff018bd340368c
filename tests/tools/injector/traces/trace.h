// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/models/draws.h"

namespace tendon::injector {

inline constexpr std::string_view kTraceBegins = "# tendon-trace 1";

// A recorded network with the fate, the time and the cause of every datagram, as CSV after some header lines:
//
//     # tendon-trace 1
//     # seed 7
//     # start 0                          start of the run, on the clock of all times below (ns)
//     # up delay=lognormal(20ms,5ms)     the initial profiles, or "replay of FILE, then" the profile that was added
//     # down delay=20ms
//     # tables 3c0ffee0ddba11ad          hashes of the quantile tables in use, 16 hexadecimal digits each
//     # build v0.1.0-12-gabc1234         the program that wrote it
//     # benign up 20000000               only in a sparse trace: see Trace::benign
//     dir,link,index,t_in_ns,bytes,hash,verdict,cause,t_out_ns,t_actual_ns,duplicate_ns,stale_back,stale_ns,flipped_bit,truncated_to,rebinds
//     up,0,0,1000000,213,b1946ac92492d234,pass,delay,21340211,21391002,,,,,,0
//     # note 5000000000 both wifi-bad    notes can stand between the datagrams
//     …
//
// The first line and the line of column names are required; other lines with # are optional, at most one of each kind
// before the column names. All times are integers in nanoseconds. A field without a value is empty. The columns are the
// members of TraceRecord. The one-way delay is t_out_ns − t_in_ns as decided, t_actual_ns − t_in_ns in a run of the
// proxy.
//
// Datagrams can be in any order, but each index of a flow (a direction of a link) occurs only once, and t_in_ns must
// not decrease with the index of a flow.

/// One datagram: the decision and its execution.
struct TraceRecord : Decision {
  Direction direction = Direction::kUp;
  std::uint32_t link = 0;
  std::optional<std::uint64_t> payload_hash;  ///< payload_hash() of the original payload; empty if unknown
  std::optional<LocalTime> actual;  ///< actual departure of the first copy; empty in virtual time, and for a lost
                                    ///< datagram

  bool operator==(const TraceRecord&) const = default;
};

struct TraceHeader {
  std::uint64_t seed = 0;
  LocalTime start{};
  std::string up, down;  ///< profiles, as written by to_string(); empty for imported traces
  std::vector<std::uint64_t> tables;
  std::string build;
  /// In a sparse trace, by Direction: the delay of datagrams that are not among the records. A trace with either value
  /// is sparse: it lists only relevant datagrams (see shrink.h), and TracePlayer passes all others. In any other trace,
  /// missing datagrams were not recorded.
  std::array<std::optional<Duration>, 2> benign;

  bool sparse() const { return benign[0].has_value() || benign[1].has_value(); }
  bool operator==(const TraceHeader&) const = default;
};

struct Trace : TraceHeader {
  std::vector<TraceRecord> records;
  struct Note {
    std::size_t before = 0;  ///< number of preceding records
    std::string text;
    bool operator==(const Note&) const = default;
  };
  std::vector<Note> notes;

  bool operator==(const Trace&) const = default;
};

// Limits for hostile or damaged files.
inline constexpr std::size_t kMaxTraceRecords =
    20'000'000;  ///< nearly three hours of 1 kHz both ways: 2.7 GB of memory
inline constexpr std::size_t kMaxTraceLine = std::size_t{1} << 24;  ///< the longest profile: 1 000 000 opportunities
inline constexpr std::uint64_t kMaxTraceIndex = (std::uint64_t{1} << 62) - 1;
/// Times of a trace are within this distance from zero (73 years), so that sums of two do not overflow.
inline constexpr Duration kMaxTraceTime{std::int64_t{1} << 61};

/// Writes a trace incrementally, beginning with the header. This takes about 0.2 µs for each record. Passes each line
/// to the stream in one piece, so that the stream controls buffering. The stream's state reports errors.
///
/// Thread-safe: no. (The proxy uses it in a separate thread.)
class TraceWriter {
 public:
  /// Throws std::invalid_argument if a text in `header` contains a line break, which the format cannot represent.
  TraceWriter(std::ostream& to, const TraceHeader& header);

  void write(const TraceRecord& record);
  /// Writes a comment, by convention the time in nanoseconds and a description. Line breaks become blanks.
  void note(std::string_view text);

 private:
  std::ostream& to_;
};

void write_trace(std::ostream& to, const Trace& trace);

/// Reads the output of TraceWriter; read and write are exact inverses. `name` is the file in errors. Throws
/// std::runtime_error for any deviation from the format: "run.csv:17: verdict is "lost", expected pass, drop or dup".
/// Safe for arbitrary input.
Trace read_trace(std::istream& from, const std::string& name);
Trace read_trace(const std::filesystem::path& path);

/// Writes the one-way delays for other programs; import_csv() reads them back.
///
///     dir,link,index,t_ms,delay_ms,actual_delay_ms
///
/// t_ms counts from the trace's start; delays of lost datagrams are empty.
void write_delays(std::ostream& to, const Trace& trace);

/// XXH64 with seed 0 (libxxhash) of the original payload.
std::uint64_t payload_hash(std::span<const std::byte> payload) noexcept;

}  // namespace tendon::injector
