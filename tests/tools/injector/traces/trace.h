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

/// The first line of a trace.
inline constexpr std::string_view kTraceBegins = "# tendon-trace 1";

// A recorded network: what happened to every datagram, when and why. One text format, which is CSV with a few lines in
// front of it:
//
//   # tendon-trace 1
//   # seed 7
//   # start 0                          when the run began, on the clock of all times below (ns)
//   # up delay=lognormal(20ms,5ms)     the profiles that it began with
//   # down delay=20ms
//   # tables 3c0ffee0ddba11ad          hashes of the quantile tables in use, 16 hexadecimal digits each
//   # build v0.1.0-12-gabc1234         the program that wrote it
//   # benign up 20000000               only in a sparse trace: see Trace::benign
//   dir,link,index,t_in_ns,bytes,hash,verdict,cause,t_out_ns,t_actual_ns,duplicate_ns,stale_back,stale_ns,flipped_bit,truncated_to,rebinds
//   up,0,0,1000000,213,b1946ac92492d234,pass,delay,21340211,21391002,,,,,,0
//   # note 5000000000 both wifi-bad    notes may stand between the datagrams
//   …
//
// The first line is always that one, the line of column names is required, all other lines with # are optional, and
// each of those before the column names is there once at most. Times are whole nanoseconds; an empty field is what does
// not exist. The columns are the members of TraceRecord. The true one-way delay of a datagram is t_out_ns − t_in_ns; in
// a run of the proxy the one it had in truth is t_actual_ns − t_in_ns (write_delays() lists both in milliseconds).
//
// Datagrams may come in any order, but each of a flow (a direction of a link) only once, and t_in_ns never falls while
// the index of a flow grows.

/// One datagram: what was decided, and how it went.
struct TraceRecord : Decision {
  Direction direction = Direction::kUp;
  std::uint32_t link = 0;
  std::optional<std::uint64_t> payload_hash;  ///< payload_hash() of what entered the network; empty when nobody looked
  std::optional<LocalTime> actual;  ///< when the first copy really left; empty in virtual time, and for a lost one

  bool operator==(const TraceRecord&) const = default;
};

/// What is said once for a whole trace.
struct TraceHeader {
  std::uint64_t seed = 0;
  LocalTime start{};
  std::string up, down;               ///< profiles, as to_string() writes them; empty for imported traces
  std::vector<std::uint64_t> tables;  ///< hashes of the quantile tables
  std::string build;
  /// Of a sparse trace, by Direction: how long a datagram takes that is not among the records. A trace in which either
  /// is given is sparse: it lists only the datagrams whose fate matters (see shrink.h), and TracePlayer lets all others
  /// pass. In any other trace, what is missing was not recorded.
  std::array<std::optional<Duration>, 2> benign;

  bool sparse() const { return benign[0].has_value() || benign[1].has_value(); }
  bool operator==(const TraceHeader&) const = default;
};

struct Trace : TraceHeader {
  std::vector<TraceRecord> records;
  struct Note {
    std::size_t before = 0;  ///< how many records stand before it
    std::string text;
    bool operator==(const Note&) const = default;
  };
  std::vector<Note> notes;

  bool operator==(const Trace&) const = default;
};

// Limits of what is read, against a hostile or broken file.
inline constexpr std::size_t kMaxTraceRecords =
    20'000'000;  ///< nearly three hours of 1 kHz both ways: 2.7 GB of memory
inline constexpr std::size_t kMaxTraceLine = std::size_t{1} << 24;  ///< the longest profile: 1 000 000 opportunities
inline constexpr std::uint64_t kMaxTraceIndex = (std::uint64_t{1} << 62) - 1;
/// No time of a trace is further than this from zero (73 years), so that sums of two do not overflow.
inline constexpr Duration kMaxTraceTime{std::int64_t{1} << 61};

/// Writes a trace while it happens: the header at once, then line after line. About 0.2 µs of CPU per record; formats
/// into a buffer of its own and gives it to the stream in one piece, so the stream decides what waits and when it is
/// flushed. That something could not be written is the stream's state.
///
/// Thread-safe: no. (The proxy gives it a thread of its own.)
class TraceWriter {
 public:
  /// Throws std::invalid_argument when a text in `header` holds a line break, which the format has no way to say.
  TraceWriter(std::ostream& to, const TraceHeader& header);

  void write(const TraceRecord& record);
  /// A comment, here; by custom the time in nanoseconds and what was changed. Line breaks become blanks.
  void note(std::string_view text);

 private:
  std::ostream& to_;
};

/// The whole trace, as TraceWriter would have.
void write_trace(std::ostream& to, const Trace& trace);

/// Reads what TraceWriter wrote, exactly: read ∘ write and write ∘ read are the identity. `name` is the file in errors.
/// Throws std::runtime_error for anything that is not as said above: "run.csv:17: verdict is "lost", expected pass,
/// drop or dup". No bytes whatever make it do anything else.
Trace read_trace(std::istream& from, const std::string& name);
Trace read_trace(const std::filesystem::path& path);

/// The true one-way delays, for people and other programs: import_csv() reads them back.
///
///     dir,link,index,t_ms,delay_ms,actual_delay_ms
///
/// t_ms counts from the trace's start; delays of lost datagrams are empty.
void write_delays(std::ostream& to, const Trace& trace);

/// XXH64 with seed 0 (xxhash.com; here of libxxhash), of the payload as it entered the network.
std::uint64_t payload_hash(std::span<const std::byte> payload) noexcept;

}  // namespace tendon::injector
