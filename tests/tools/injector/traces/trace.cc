// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/trace.h"

#include <xxhash.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <istream>
#include <map>
#include <ostream>
#include <stdexcept>
#include <system_error>
#include <tuple>
#include <utility>

#include "protocol/byte_order_mark.h"
#include "server/machine/regular_file.h"

namespace tendon::injector {
namespace {

constexpr std::string_view kVersion = kTraceBegins;
constexpr std::string_view kColumns =
    "dir,link,index,t_in_ns,bytes,hash,verdict,cause,t_out_ns,t_actual_ns,duplicate_ns,stale_back,stale_ns,flipped_bit,"
    "truncated_to,rebinds";
constexpr std::size_t kColumnCount = 16;
constexpr std::string_view kNote = "# note ";

constexpr std::array<std::string_view, 2> kDirections = {"up", "down"};

/// A line under construction. No field is longer than 20 characters, so a record's 16 fit.
class Line {
 public:
  Line& text(std::string_view text) {
    end_ = std::copy(text.begin(), text.end(), end_);
    return *this;
  }
  template <class Integer>
  Line& number(Integer value) {
    end_ = std::to_chars(end_, buffer_.data() + buffer_.size(), value).ptr;
    return *this;
  }
  Line& time(LocalTime at) { return number(at.time_since_epoch().count()); }
  Line& maybe(const std::optional<LocalTime>& at) { return at ? time(*at) : *this; }
  Line& maybe(const std::optional<std::uint32_t>& value) { return value ? number(*value) : *this; }
  Line& hexadecimal(std::uint64_t value) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    for (int shift = 60; shift >= 0; shift -= 4) *end_++ = kDigits[(value >> shift) & 0xf];
    return *this;
  }
  Line& comma() {
    *end_++ = ',';
    return *this;
  }
  void give(std::ostream& to) const { to.write(buffer_.data(), end_ - buffer_.data()); }

 private:
  std::array<char, 512> buffer_;
  char* end_ = buffer_.data();
};

void write_text(std::ostream& to, std::string_view key, std::string_view text) {
  if (text.empty()) return;
  if (text.find_first_of("\r\n") != std::string_view::npos) {
    throw std::invalid_argument("\"" + std::string(key) + "\" in the header of a trace: expected one line");
  }
  to << "# " << key << ' ' << text << '\n';
}

/// Quotes and truncates text of an untrusted file, and removes terminal control characters.
std::string shown(std::string_view text) {
  constexpr std::size_t kShown = 40;
  std::string start(text.substr(0, kShown));
  for (char& c : start) c = c >= ' ' && c <= '~' ? c : '?';
  return '"' + start + (text.size() > kShown ? "…\"" : "\"");
}

template <class Integer>
std::optional<Integer> whole(std::string_view text, int base = 10) {
  Integer value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

class Reader {
 public:
  Reader(std::istream& from, const std::string& name) : from_(from), name_(name) {}

  Trace read() {
    if (!next_line() || line_ != kVersion) fail("expected the first line of a trace, " + shown(kVersion));
    for (;;) {
      if (!next_line()) fail("the trace ends before its column names");
      if (!line_.starts_with('#')) break;
      header(std::string_view(line_));
    }
    if (line_ != kColumns) fail("expected the column names " + std::string(kColumns));
    while (next_line()) {
      if (line_.starts_with(kNote)) {
        trace_.notes.push_back({trace_.records.size(), line_.substr(kNote.size())});
        continue;
      }
      if (trace_.records.size() == kMaxTraceRecords) {
        fail("expected at most " + std::to_string(kMaxTraceRecords) + " datagrams");
      }
      trace_.records.push_back(record());
      place(trace_.records.back());
    }
    check_order();
    return std::move(trace_);
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw std::runtime_error(name_ + ':' + std::to_string(number_) + ": " + sentence);
  }

  /// Returns false at the end. Rejects a last line without a line break, which was truncated while it was written.
  bool next_line() {
    ++number_;
    line_.clear();
    if (from_.peek() == std::istream::traits_type::eof()) return false;
    std::getline(from_, line_);
    if (from_.bad()) fail("cannot be read");
    if (from_.eof()) fail("the last line is incomplete; remove it to use the rest of the trace");
    if (number_ == 1) line_ = without_byte_order_mark(line_);
    if (line_.size() > kMaxTraceLine) fail("the line is longer than " + std::to_string(kMaxTraceLine) + " bytes");
    if (line_.find('\r') != std::string::npos) fail("found a carriage return, expected lines that end with \\n");
    return true;
  }

  void header(std::string_view line) {
    if (!line.starts_with("# ")) fail("expected \"# KEY VALUE\", found " + shown(line));
    line.remove_prefix(2);
    // The key of a benign delay has two words, all others one.
    const std::size_t from = line.starts_with("benign ") ? 7 : 0;
    const std::size_t blank = std::min(line.find(' ', from), line.size());
    const std::string key(line.substr(0, blank));
    const std::string_view value = line.substr(std::min(blank + 1, line.size()));
    if (value.empty()) fail("# " + key + " has no value");
    if (std::ranges::find(seen_, key) != seen_.end()) fail("# " + key + " occurs twice");
    seen_.push_back(key);
    if (key == "seed") {
      trace_.seed = number<std::uint64_t>(key, value, "a whole number");
    } else if (key == "start") {
      trace_.start = time(key, value);
    } else if (key == "up") {
      trace_.up = value;
    } else if (key == "down") {
      trace_.down = value;
    } else if (key == "build") {
      trace_.build = value;
    } else if (key == "tables") {
      tables(value);
    } else if (key == "benign up" || key == "benign down") {
      const Duration delay = time(key, value) - LocalTime{};
      if (delay < Duration::zero()) fail(key + " is " + shown(value) + ", expected a delay of 0 ns or more");
      trace_.benign[key == "benign up" ? 0 : 1] = delay;
    } else {
      fail("# " + shown(key) + ": unknown, expected seed, start, up, down, tables, build, benign up or benign down");
    }
  }

  void tables(std::string_view text) {
    for (;;) {
      const std::string_view hash = text.substr(0, text.find(' '));
      trace_.tables.push_back(hexadecimal("tables", hash));
      if (hash.size() == text.size()) return;
      text.remove_prefix(hash.size() + 1);
    }
  }

  TraceRecord record() {
    std::array<std::string_view, kColumnCount> fields;
    std::string_view rest = line_;
    std::size_t count = 0;
    for (;; ++count) {
      const std::size_t comma = rest.find(',');
      if (count < kColumnCount) fields[count] = rest.substr(0, comma);
      if (comma == std::string_view::npos) break;
      rest.remove_prefix(comma + 1);
    }
    if (++count != kColumnCount) {
      fail("expected " + std::to_string(kColumnCount) + " fields, found " + std::to_string(count));
    }
    const auto& [dir, link, index, t_in, bytes, hash, verdict, cause, t_out, t_actual, duplicate, stale_back, stale,
                 flipped_bit, truncated_to, rebinds] = fields;

    TraceRecord record;
    if (dir != kDirections[0] && dir != kDirections[1]) fail("dir is " + shown(dir) + ", expected up or down");
    record.direction = dir == kDirections[0] ? Direction::kUp : Direction::kDown;
    record.link = number<std::uint32_t>("link", link, "a whole number");
    record.index = number<std::uint64_t>("index", index, "a whole number");
    if (record.index > kMaxTraceIndex) fail("index is " + shown(index) + ", expected less than 2^62");
    record.arrival = time("t_in_ns", t_in);
    record.size = number<std::uint32_t>("bytes", bytes, "a whole number");
    if (!hash.empty()) record.payload_hash = hexadecimal("hash", hash);
    const auto known_verdict = parse_verdict(verdict);
    if (!known_verdict) fail("verdict is " + shown(verdict) + ", expected pass, drop or dup");
    record.verdict = *known_verdict;
    const auto known_cause = parse_cause(cause);
    if (!known_cause) fail("cause is " + shown(cause) + ", which is unknown");
    record.cause = *known_cause;
    record.release = later("t_out_ns", t_out, record.arrival);
    if (!t_actual.empty()) record.actual = time("t_actual_ns", t_actual);
    if (!duplicate.empty()) record.duplicate = later("duplicate_ns", duplicate, record.arrival);
    if (stale_back.empty() != stale.empty()) fail("stale_back and stale_ns: expected both or neither");
    if (!stale.empty()) {
      const auto back = number<std::uint32_t>("stale_back", stale_back, "a whole number");
      if (back < 1 || back > kMaxReplayDepth) {
        fail("stale_back is " + shown(stale_back) + ", expected 1 to " + std::to_string(kMaxReplayDepth));
      }
      record.stale = {later("stale_ns", stale, record.arrival), back};
    }
    if (!flipped_bit.empty()) record.flipped_bit = number<std::uint32_t>("flipped_bit", flipped_bit, "a whole number");
    if (!truncated_to.empty()) {
      record.truncated_to = number<std::uint32_t>("truncated_to", truncated_to, "a whole number");
    }
    record.rebinds = number<std::uint32_t>("rebinds", rebinds, "a whole number");
    if ((record.verdict == Verdict::kDuplicate) != record.duplicate.has_value()) {
      fail("duplicate_ns: expected a time where verdict is dup, and none elsewhere");
    }
    return record;
  }

  /// Most traces are in order; check_order() handles the others.
  void place(const TraceRecord& record) {
    const auto [at, first] = flows_.try_emplace({record.direction, record.link}, Newest{record.index, record.arrival});
    Newest& newest = at->second;
    if (first) return;
    if (record.index <= newest.index) {
      in_order_ = false;
    } else if (record.arrival < newest.arrival) {
      fail("t_in_ns is earlier than that of a datagram of the same flow with a smaller index");
    }
    newest = {record.index, record.arrival};
  }

  void check_order() {
    if (in_order_) return;
    std::vector<const TraceRecord*> sorted;
    for (const TraceRecord& record : trace_.records) sorted.push_back(&record);
    std::ranges::sort(sorted, {}, [](const TraceRecord* r) { return std::tuple(r->direction, r->link, r->index, r); });
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      const TraceRecord& a = *sorted[i - 1];
      const TraceRecord& b = *sorted[i];
      if (a.direction != b.direction || a.link != b.link) continue;
      if (a.index == b.index) {
        number_ = line_of(b);
        fail("datagram " + std::to_string(b.index) + " of this flow occurs twice, first in line " +
             std::to_string(line_of(a)));
      }
      if (b.arrival < a.arrival) {
        number_ = line_of(b);
        fail("t_in_ns is earlier than that of a datagram of the same flow with a smaller index");
      }
    }
  }

  std::size_t line_of(const TraceRecord& record) const {
    const auto index = static_cast<std::size_t>(&record - trace_.records.data());
    const auto notes = std::ranges::count_if(trace_.notes, [&](const Trace::Note& n) { return n.before <= index; });
    return 2 + seen_.size() + 1 + index + static_cast<std::size_t>(notes);
  }

  template <class Integer>
  Integer number(std::string_view field, std::string_view text, std::string_view expected) const {
    const auto value = whole<Integer>(text);
    if (!value) fail(std::string(field) + " is " + shown(text) + ", expected " + std::string(expected));
    return *value;
  }

  std::uint64_t hexadecimal(std::string_view field, std::string_view text) const {
    const auto value = whole<std::uint64_t>(text, 16);
    if (!value || text.size() != 16) {
      fail(std::string(field) + " is " + shown(text) + ", expected 16 hexadecimal digits");
    }
    return *value;
  }

  LocalTime time(std::string_view field, std::string_view text) const {
    const Duration at(number<std::int64_t>(field, text, "whole nanoseconds"));
    if (at > kMaxTraceTime || at < -kMaxTraceTime) {
      fail(std::string(field) + " is " + shown(text) + ", expected a time within 73 years of zero");
    }
    return LocalTime(at);
  }

  LocalTime later(std::string_view field, std::string_view text, LocalTime arrival) const {
    const LocalTime at = time(field, text);
    if (at < arrival) fail(std::string(field) + " is earlier than t_in_ns");
    return at;
  }

  struct Newest {
    std::uint64_t index;
    LocalTime arrival;
  };

  std::istream& from_;
  const std::string& name_;
  std::size_t number_ = 0;
  std::string line_;
  std::vector<std::string> seen_;
  Trace trace_;
  std::map<std::pair<Direction, std::uint32_t>, Newest> flows_;
  bool in_order_ = true;
};

std::string milliseconds(Duration duration) {
  const std::int64_t ns = duration.count();
  std::string decimals = std::to_string(1'000'000 + std::abs(ns % 1'000'000)).substr(1);
  return (ns < 0 ? "-" : "") + std::to_string(std::abs(ns / 1'000'000)) + '.' + decimals;
}

}  // namespace

TraceWriter::TraceWriter(std::ostream& to, const TraceHeader& header) : to_(to) {
  to_ << kVersion << "\n# seed " << header.seed << "\n# start " << header.start.time_since_epoch().count() << '\n';
  write_text(to_, "up", header.up);
  write_text(to_, "down", header.down);
  if (!header.tables.empty()) {
    to_ << "# tables";
    for (const std::uint64_t hash : header.tables) {
      Line().text(" ").hexadecimal(hash).give(to_);
    }
    to_ << '\n';
  }
  write_text(to_, "build", header.build);
  for (std::size_t i = 0; i < 2; ++i) {
    if (header.benign[i]) to_ << "# benign " << kDirections[i] << ' ' << header.benign[i]->count() << '\n';
  }
  to_ << kColumns << '\n';
}

void TraceWriter::write(const TraceRecord& record) {
  Line line;
  line.text(kDirections[static_cast<std::size_t>(record.direction)]).comma();
  line.number(record.link).comma().number(record.index).comma().time(record.arrival).comma();
  line.number(record.size).comma();
  if (record.payload_hash) line.hexadecimal(*record.payload_hash);
  line.comma().text(to_string(record.verdict)).comma().text(to_string(record.cause)).comma();
  line.time(record.release).comma().maybe(record.actual).comma().maybe(record.duplicate).comma();
  if (record.stale) line.number(record.stale->back).comma().time(record.stale->release).comma();
  if (!record.stale) line.comma().comma();
  line.maybe(record.flipped_bit).comma().maybe(record.truncated_to).comma().number(record.rebinds).text("\n");
  line.give(to_);
}

void TraceWriter::note(std::string_view text) {
  std::string line(text);
  std::ranges::replace_if(
      line, [](char c) { return c == '\r' || c == '\n'; }, ' ');
  to_ << kNote << line << '\n';
}

void write_trace(std::ostream& to, const Trace& trace) {
  TraceWriter writer(to, trace);
  auto note = trace.notes.begin();
  for (std::size_t i = 0; i <= trace.records.size(); ++i) {
    for (; note != trace.notes.end() && note->before <= i; ++note) writer.note(note->text);
    if (i < trace.records.size()) writer.write(trace.records[i]);
  }
}

Trace read_trace(std::istream& from, const std::string& name) { return Reader(from, name).read(); }

Trace read_trace(const std::filesystem::path& path) {
  std::ifstream file = open_regular_file(path, "trace");
  return read_trace(file, path.string());
}

void write_delays(std::ostream& to, const Trace& trace) {
  to << "dir,link,index,t_ms,delay_ms,actual_delay_ms\n";
  for (const TraceRecord& record : trace.records) {
    const bool lost = record.verdict == Verdict::kDrop;
    to << kDirections[static_cast<std::size_t>(record.direction)] << ',' << record.link << ',' << record.index << ','
       << milliseconds(record.arrival - trace.start) << ','
       << (lost ? "" : milliseconds(record.release - record.arrival)) << ','
       << (record.actual ? milliseconds(*record.actual - record.arrival) : "") << '\n';
  }
}

std::uint64_t payload_hash(std::span<const std::byte> payload) noexcept {
  return XXH64(payload.data(), payload.size(), 0);
}

}  // namespace tendon::injector
