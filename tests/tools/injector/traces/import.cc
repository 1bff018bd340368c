// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/byte_order_mark.h"
#include "server/tables/table_reader.h"
#include "tests/tools/injector/profile/tables.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {
namespace {

struct Fate {
  bool lost = false;
  Duration delay{};
};
struct Fates {
  std::optional<Fate> up, down;
};

[[noreturn]] void refuse(const std::string& name, std::size_t line, const std::string& sentence) {
  throw std::runtime_error(name + ':' + std::to_string(line) + ": " + sentence);
}

std::string start_of(std::string_view text) { return in_quotes(text.substr(0, 60)); }

void need_shared(const std::string& name, const ImportOptions& options) {
  if (options.share == Share::kMeasured) {
    throw std::runtime_error(name + ": has one delay for each packet, expected --share up, down, both or halves");
  }
  if (options.interval <= Duration::zero()) throw std::runtime_error("the interval of an import must be above zero");
}

/// An empty delay is a loss.
Fates shared(Share share, const std::optional<Duration>& delay) {
  const Fate whole{!delay, delay.value_or(Duration::zero())};
  switch (share) {
    case Share::kUp:
      return {whole, std::nullopt};
    case Share::kDown:
      return {std::nullopt, whole};
    case Share::kBoth:
      return {whole, whole};
    case Share::kHalves:
    case Share::kMeasured:
      break;
  }
  if (!delay) return {whole, std::nullopt};
  return {Fate{false, *delay / 2}, Fate{false, *delay - *delay / 2}};
}

class Building {
 public:
  explicit Building(const std::string& name) : name_(name) { trace_.notes.push_back({0, "imported from " + name}); }

  void add(Duration at, Share share, const Fates& fates, std::uint32_t size = 0) {
    // In a round trip, an unknown fate belongs to a datagram, and the return trip starts after the forward trip.
    const bool round_trip = share == Share::kHalves || share == Share::kMeasured;
    if (fates.up || round_trip) put(Direction::kUp, at, fates.up, size);
    if (round_trip && fates.up) at += fates.up->delay;
    if (fates.down || round_trip) put(Direction::kDown, at, fates.down, size);
  }

  Trace trace() && { return std::move(trace_); }

 private:
  void put(Direction direction, Duration at, const std::optional<Fate>& fate, std::uint32_t size) {
    // Half the limit leaves room for a delay.
    if (at > kMaxTraceTime / 2 || at < -kMaxTraceTime / 2) {
      throw std::runtime_error(name_ + ": expected less than 36 years from its first to its last packet");
    }
    auto& [index, newest] = flows_[static_cast<std::size_t>(direction)];
    newest = std::max(newest, at);  // after a reordered one
    TraceRecord record;
    record.direction = direction;
    record.index = index++;
    record.arrival = LocalTime(newest);
    record.size = size;
    if (!fate) return;
    if (trace_.records.size() == kMaxTraceRecords) {
      throw std::runtime_error(name_ + ": expected at most " + std::to_string(kMaxTraceRecords) + " packets");
    }
    record.release = record.arrival + fate->delay;
    if (fate->lost) record.verdict = Verdict::kDrop;
    record.cause = fate->lost ? Cause::kLoss : Cause::kDelay;
    trace_.records.push_back(record);
  }

  struct Flow {
    std::uint64_t index = 0;
    Duration newest = Duration::min();
  };
  const std::string& name_;
  Trace trace_;
  std::array<Flow, 2> flows_;
};

Duration evenly(std::int64_t number, Duration interval) {
  return interval > kMaxTraceTime / std::max<std::int64_t>(number, 1) ? kMaxTraceTime : number * interval;
}

template <class Take>
void each_line(std::istream& from, const std::string& name, const Take& take) {
  std::string line;
  for (std::size_t number = 1; std::getline(from, line); ++number) {
    if (line.size() > kMaxTraceLine) refuse(name, number, "the line is too long");
    if (line.ends_with('\r')) line.pop_back();
    take(number == 1 ? without_byte_order_mark(line) : std::string_view(line), number);
  }
  if (from.bad()) throw std::runtime_error(name + ": cannot read the file");
}

/// Maximum number of losses from one number in a file, so that a small file cannot exhaust the memory.
constexpr std::uint64_t kMostLost = 65'536;

/// The integer after the last `label` in the line, for example "icmp_seq=" in "… icmp_seq=3 ttl=64 time=26.3 ms".
std::optional<std::uint64_t> whole_after(std::string_view line, std::string_view label) {
  const std::size_t at = line.rfind(label);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view rest = line.substr(at + label.size());
  return parse_whole(rest.substr(0, rest.find_first_not_of("0123456789")));
}

class PingTimes {
 public:
  explicit PingTimes(const std::string& name) : name_(name) {}

  /// A single comma is a decimal comma, which check() verifies later.
  Duration in(std::string_view line, std::size_t number) {
    const std::size_t at = line.rfind("time=");
    const std::string_view text = line.substr(std::min(at, line.size()));
    const std::string_view digits = at == std::string_view::npos ? text : text.substr(5);
    const std::string_view written = digits.substr(0, digits.find_first_not_of("0123456789.,"));
    const auto value = number_of(written, number);
    std::string_view unit = trimmed(digits.substr(written.size()));
    unit = unit.substr(0, unit.find_first_of(" \t("));
    struct Unit {
      std::string_view name;
      double ns;
    };
    constexpr std::array kUnits = {Unit{"ms", 1e6},   Unit{"us", 1e3},   Unit{"µs", 1e3}, Unit{"μs", 1e3},
                                   Unit{"usec", 1e3}, Unit{"msec", 1e6}, Unit{"s", 1e9},  Unit{"sec", 1e9}};
    const auto* const found = std::ranges::find(kUnits, unit, &Unit::name);
    const auto time = value && found != kUnits.end() ? to_duration(*value, found->ns) : std::nullopt;
    if (!time) refuse(name_, number, "expected time=… ms, us or s in " + start_of(line));
    return *time;
  }

  /// Throws if commas could be decimal commas or thousands separators.
  void check() const {
    const bool thousands = point_ != 0 || whole_ != 0;
    if (comma_ != 0 && point_ != 0) {
      refuse(name_, std::max(comma_, point_),
             "expected the decimal sign of line " + std::to_string(std::min(comma_, point_)) + ", found another");
    }
    if (comma_ != 0 || either_ == 0 || !thousands) return;
    refuse(name_, either_,
           "expected a decimal point, found time=" + either_text_ +
               ": is the comma a decimal comma, or a thousands separator?");
  }

 private:
  static bool groups(std::string_view text, char between) {
    const std::size_t first = text.find(between);
    if (first == 0 || first > 3 || text.front() == '0') return false;
    for (std::size_t at = first; at < text.size(); at += 4) {
      if (text[at] != between || text.size() - at < 4 || text.substr(at + 1, 3).find(between) < 3) return false;
    }
    return true;
  }

  std::optional<double> number_of(std::string_view text, std::size_t line) {
    const std::size_t sign = text.find_last_of(".,");
    if (sign == std::string_view::npos) {
      first(whole_, line);
      return parse_number(text);
    }
    const std::string_view before = text.substr(0, sign);
    const char other = text[sign] == ',' ? '.' : ',';
    std::string digits(before);
    if (before.find_first_of(".,") != std::string_view::npos) {
      if (before.find(text[sign]) != std::string_view::npos || !groups(before, other)) return std::nullopt;
      std::erase(digits, other);
    } else if (text[sign] == ',' && groups(text, ',')) {
      if (either_ == 0) either_text_ = text;
      first(either_, line);
      return parse_number(digits + "." + std::string(text.substr(sign + 1)));
    }
    first(text[sign] == ',' ? comma_ : point_, line);
    return parse_number(digits + "." + std::string(text.substr(sign + 1)));
  }

  static void first(std::size_t& where, std::size_t line) { where = where == 0 ? line : where; }

  const std::string& name_;
  // The number of the first line with each kind of number, or 0.
  std::size_t whole_ = 0, point_ = 0, comma_ = 0;
  std::size_t either_ = 0;  ///< for example "1,012"
  std::string either_text_;
};

/// Parses the "[1699459200.123456] " of ping -D, the time since 1970.
std::optional<Duration> time_stamp(std::string_view line) {
  if (!line.starts_with('[')) return std::nullopt;
  const std::string_view text = line.substr(1, line.find(']') - 1);
  const std::size_t point = std::min(text.find_first_of(".,"), text.size());
  const auto whole = parse_whole(text.substr(0, point));
  const auto micros = parse_whole(text.substr(std::min(point + 1, text.size())));
  if (!whole || !micros || text.size() - point != 7 || *whole > 4'000'000'000U) return std::nullopt;
  return std::chrono::seconds(*whole) + std::chrono::microseconds(*micros);
}

struct PingLog {
  struct Answer {
    Duration round_trip{};
    std::optional<Duration> received;
  };
  std::map<std::int64_t, Answer> answers;  ///< by unwrapped sequence number
  std::int64_t first = 0, last = 0;        ///< of all requests
  std::optional<Duration> interval;        ///< from the summary
  std::uint32_t size = 0;
};

PingLog read_ping(std::istream& from, const std::string& name) {
  PingLog log;
  std::optional<std::uint64_t> transmitted;
  std::optional<std::int64_t> newest, oldest, latest;
  PingTimes times(name);
  each_line(from, name, [&](std::string_view line, std::size_t number) {
    if (const std::size_t at = line.find(" packets transmitted"); at != std::string_view::npos) {
      transmitted = parse_whole(line.substr(0, at));
      const auto total = whole_after(line, ", time ");
      if (total && transmitted && *transmitted > 1 && *total > 0 && *total < 4'000'000'000U) {
        log.interval = Duration(std::chrono::milliseconds(*total)) / static_cast<std::int64_t>(*transmitted - 1);
      }
      return;
    }
    const bool answer = line.find(" bytes from ") != std::string_view::npos;
    auto sequence = whole_after(line, "icmp_seq=");
    if (!sequence) sequence = whole_after(line, ": seq=");
    if (!sequence || *sequence > 0xffff) {
      if (answer) refuse(name, number, "expected icmp_seq=0 to 65535 in " + start_of(line));
      return;
    }
    // Unwraps the 16-bit number to the value nearest to its predecessor.
    const std::int64_t before = newest.value_or(static_cast<std::int64_t>(*sequence));
    const auto step =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(*sequence) - static_cast<std::uint16_t>(before));
    const std::int64_t index = before + step;
    newest = index;
    oldest = std::min(oldest.value_or(index), index);
    latest = std::max(latest.value_or(index), index);
    if (!answer) return;
    log.answers.try_emplace(index, PingLog::Answer{times.in(line, number), time_stamp(line)});
    const std::string_view counted =
        line.starts_with('[') ? line.substr(std::min(line.find("] "), line.size() - 2) + 2) : line;
    log.size = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(parse_whole(counted.substr(0, counted.find(' '))).value_or(0), 0xffff));
  });
  if (log.answers.empty()) {
    throw std::runtime_error(name +
                             ": has no answers; expected the English output of ping on Linux or macOS: LC_ALL=C ping");
  }
  times.check();
  log.first = *oldest;
  log.last = *latest;
  // iputils counts from 1, busybox from 0. Further packets in the summary were lost at the beginning or the end.
  const std::int64_t begin = std::min<std::int64_t>(log.first, 1);
  const auto most = static_cast<std::uint64_t>(log.last - begin) + kMostLost;
  if (transmitted && *transmitted <= most && begin + static_cast<std::int64_t>(*transmitted) > log.last) {
    log.first = begin;
    log.last = begin + static_cast<std::int64_t>(*transmitted) - 1;
  }
  if (log.last - log.first >= static_cast<std::int64_t>(kMaxTraceRecords)) {
    throw std::runtime_error(name + ": expected at most " + std::to_string(kMaxTraceRecords) + " packets");
  }
  return log;
}

using Json = nlohmann::json;

const Json* look_up(const Json& json, std::initializer_list<const char*> path) {
  const Json* at = &json;
  for (const char* key : path) {
    if (!at->is_object()) return nullptr;
    const auto found = at->find(key);
    if (found == at->end()) return nullptr;
    at = &*found;
  }
  return at;
}

std::optional<std::int64_t> integer(const Json* json) {
  if (json == nullptr || !json->is_number_integer()) return std::nullopt;
  return json->get<std::int64_t>();
}

class IrttTrip {
 public:
  IrttTrip(const Json& json, std::string place) : json_(json), place_(std::move(place)) {}

  /// In nanoseconds on the client's clock.
  std::optional<std::int64_t> sent(const char* clock) const {
    return integer(look_up(json_, {"timestamps", "client", "send", clock}));
  }

  Fates fates(Share share) const {
    const std::string lost = lost_text();
    if (lost != "false" && lost != "true" && lost != "true_up" && lost != "true_down") {
      refuse("lost: expected false, true, true_up or true_down");
    }
    if (share != Share::kMeasured) {
      return shared(share, lost == "false" ? std::optional(delay("rtt")) : std::nullopt);
    }
    if (lost == "true_down") return {std::nullopt, Fate{.lost = true, .delay = {}}};
    if (lost != "false") return {Fate{.lost = true, .delay = {}}, std::nullopt};
    return {Fate{false, delay("send")}, Fate{false, delay("receive")}};
  }

 private:
  [[noreturn]] void refuse(const std::string& sentence) const { throw std::runtime_error(place_ + '.' + sentence); }

  /// This is a string in version 0.9 and later, and a boolean in older versions.
  std::string lost_text() const {
    const Json* const lost = look_up(json_, {"lost"});
    if (lost != nullptr && lost->is_boolean()) return lost->get<bool>() ? "true" : "false";
    return lost != nullptr && lost->is_string() ? lost->get<std::string>() : "";
  }

  Duration delay(const char* which) const {
    const auto ns = integer(look_up(json_, {"delay", which}));
    const std::string key = "delay." + std::string(which);
    if (!ns) refuse(key + ": expected whole nanoseconds");
    if (*ns < 0) {
      refuse(key + " is " + std::to_string(*ns) +
             " ns, because the clocks of client and server were not synchronized; import half of the round trip "
             "instead, with --share halves");
    }
    const Duration delay(*ns);
    if (delay > std::chrono::hours(24)) refuse(key + ": expected at most a day");
    return delay;
  }

  const Json& json_;
  std::string place_;
};

Json parse_json(std::istream& from, const std::string& name) {
  // Results of irtt are six levels deep.
  constexpr int kMaxDepth = 32;
  const auto not_too_deep = [&name](int depth, Json::parse_event_t, const Json&) {
    if (depth > kMaxDepth) throw std::runtime_error(name + ": nested too deeply for a result of irtt");
    return true;
  };
  try {
    return Json::parse(from, not_too_deep);
  } catch (const Json::exception& error) {
    throw std::runtime_error(name + ": not JSON: " + error.what());
  }
}

}  // namespace

Trace import_ping(std::istream& from, const std::string& name, const ImportOptions& options) {
  need_shared(name, options);
  const PingLog log = read_ping(from, name);
  const Duration interval = log.interval.value_or(options.interval);
  const bool stamped = std::ranges::all_of(log.answers, [](const auto& a) { return a.second.received.has_value(); });

  Building building(name);
  // Sending times of the nearest answered requests before and after; those in between are spread evenly.
  const auto sent = [](const auto& answer) { return *answer.second.received - answer.second.round_trip; };
  const Duration zero = stamped ? sent(*log.answers.begin()) - evenly(log.answers.begin()->first - log.first, interval)
                                : Duration::zero();
  auto after = log.answers.begin();
  for (std::int64_t index = log.first; index <= log.last; ++index) {
    while (after != log.answers.end() && after->first < index) ++after;
    const bool answered = after != log.answers.end() && after->first == index;
    Duration at = evenly(index - log.first, interval);
    if (stamped && answered) {
      at = sent(*after) - zero;
    } else if (stamped && after != log.answers.begin()) {
      const auto before = std::prev(after);
      at = sent(*before) - zero;
      const std::int64_t steps = index - before->first;
      at += after == log.answers.end() ? evenly(steps, interval)
                                       : (sent(*after) - sent(*before)) / (after->first - before->first) * steps;
    }
    building.add(at, options.share,
                 shared(options.share, answered ? std::optional(after->second.round_trip) : std::nullopt), log.size);
  }
  return std::move(building).trace();
}

Trace import_irtt(std::istream& from, const std::string& name, const ImportOptions& options) {
  const Json json = parse_json(from, name);
  const Json* const trips = look_up(json, {"round_trips"});
  if (trips == nullptr || !trips->is_array() || trips->empty()) {
    throw std::runtime_error(name + ": expected round_trips, as in the JSON file of irtt client -o");
  }
  const auto size = integer(look_up(json, {"config", "params", "length"})).value_or(0);
  const Duration interval(integer(look_up(json, {"config", "params", "interval"})).value_or(options.interval.count()));
  if (interval <= Duration::zero() || interval > std::chrono::hours(24)) {
    throw std::runtime_error(name + ": config.params.interval: expected above zero, and at most a day");
  }
  const auto place = [&name](std::size_t i) { return name + ": round_trips[" + std::to_string(i) + "]"; };
  // Uses the clock of the first trip for all.
  const char* const clock = IrttTrip((*trips)[0], place(0)).sent("monotonic") ? "monotonic" : "wall";
  const auto zero = IrttTrip((*trips)[0], place(0)).sent(clock);
  Building building(name);
  for (std::size_t i = 0; i < trips->size(); ++i) {
    const IrttTrip trip((*trips)[i], place(i));
    const auto sent = trip.sent(clock);
    Duration at = evenly(static_cast<std::int64_t>(i), interval);
    if (zero && sent) {
      if (*zero < 0 || *sent < *zero) {
        throw std::runtime_error(place(i) + ".timestamps.client.send: expected a time after the first one");
      }
      at = Duration(*sent - *zero);
    }
    building.add(at, options.share, trip.fates(options.share),
                 static_cast<std::uint32_t>(std::clamp<std::int64_t>(size, 0, 0xffff)));
  }
  return std::move(building).trace();
}

Trace import_csv(std::istream& from, const std::string& name, const ImportOptions& options) {
  need_shared(name, options);
  constexpr double kDayMs = 86.4e6;
  Building building(name);
  DelayList list = open_delays(from, name);
  TableReader& table = list.table;
  if (list.weight) table.fail("expected one row for each datagram, found a column weight, which is for samples(FILE)");
  std::optional<Duration> zero;
  std::array<Duration, 2> before = {Duration::min(), Duration::min()};  // by direction, if given
  std::int64_t count = 0;
  const auto duration = [&table](const TableReader::Column& column, double most_ms) -> std::optional<Duration> {
    const auto ms = table.number(column);
    if (!ms) return std::nullopt;
    if (std::abs(*ms) > most_ms) {
      table.fail("expected at most " + std::to_string(std::llround(most_ms / kDayMs)) + " days, found " +
                 start_of(table.text(column.index)));
    }
    return Duration(std::llround(*ms * 1e6));
  };
  while (table.next_row()) {
    const auto delay = duration(list.delay, kDayMs);
    if (delay && *delay < Duration::zero()) table.fail("the delay is below zero");
    Duration at = evenly(count, options.interval);
    if (list.t) {
      const auto t = duration(*list.t, 10'000 * kDayMs);
      if (!t) table.fail("expected a time");
      at = *t;
    }
    Share share = options.share;
    if (list.dir) {
      const std::string_view dir = table.text(*list.dir);
      if (dir != "up" && dir != "down") table.fail("dir is " + start_of(dir) + ", expected up or down");
      share = dir == "up" ? Share::kUp : Share::kDown;
    }
    Duration& newest = before[list.dir && share == Share::kDown ? 1 : 0];
    if (at < newest) table.fail("the time is earlier than the previous one");
    newest = at;
    // With directions, the times belong to a trace with a common origin.
    if (!zero) zero = list.dir ? Duration::zero() : at;
    ++count;
    building.add(at - *zero, share, shared(share, delay));
  }
  if (count == 0) throw std::runtime_error(name + ": has no delays");
  return std::move(building).trace();
}

Trace import_mahimahi_log(std::istream& from, const std::string& name, const ImportOptions& options) {
  need_shared(name, options);
  if (options.share == Share::kHalves) {
    throw std::runtime_error(name + ": is the log of one direction, expected --share up, down or both");
  }
  struct Logged {
    Duration arrival{};
    std::optional<Duration> delay;
    std::uint32_t size = 0;
  };
  std::vector<Logged> packets;
  each_line(from, name, [&](std::string_view line, std::size_t number) {
    if (line.starts_with('#')) return;
    std::array<std::string_view, 4> words;
    std::size_t count = 0;
    for (std::string_view rest = line; !rest.empty() && count < words.size(); ++count) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      words[count] = rest.substr(0, end);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    const auto ms = parse_whole(words[0]);
    const auto amount = parse_whole(words[2]);
    constexpr std::uint64_t kLatestMs = std::uint64_t{1} << 40;
    if (!ms || *ms > kLatestMs || !amount || words[1].size() != 1 ||
        std::string_view("+-#d").find(words[1][0]) == std::string_view::npos) {
      refuse(name, number, "expected a line of a log of mm-link, like \"512 - 1504 20\"");
    }
    const Duration at = std::chrono::milliseconds(*ms);
    if (words[1] == "-") {
      const auto delay = parse_whole(words[3]);
      if (!delay || *delay > *ms) refuse(name, number, "expected the delay in ms after the bytes");
      const Duration took = std::chrono::milliseconds(*delay);
      packets.push_back({at - took, took, static_cast<std::uint32_t>(std::min<std::uint64_t>(*amount, 0xffff))});
    } else if (words[1] == "d") {
      if (*amount > kMostLost) refuse(name, number, "expected at most " + std::to_string(kMostLost) + " packets");
      packets.insert(packets.end(), *amount, Logged{at, std::nullopt, 0});
    }
  });
  if (packets.empty()) throw std::runtime_error(name + ": has no packets");
  std::ranges::stable_sort(packets, {}, &Logged::arrival);
  Building building(name);
  for (const Logged& packet : packets) {
    building.add(packet.arrival - packets.front().arrival, options.share, shared(options.share, packet.delay),
                 packet.size);
  }
  return std::move(building).trace();
}

Trace import_round_trips(const std::vector<MeasuredRoundTrip>& trips, const std::string& name,
                         const ImportOptions& options) {
  need_shared(name, options);
  Building building(name);
  for (const MeasuredRoundTrip& trip : trips) {
    building.add(trip.at, options.share, shared(options.share, trip.round_trip), trip.size);
  }
  return std::move(building).trace();
}

std::string import_summary(const Trace& trace) {
  std::string text;
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    std::vector<Duration> delays;
    std::optional<Duration> first;
    Duration last{};
    std::size_t lost = 0;
    for (const TraceRecord& record : trace.records) {
      if (record.direction != direction) continue;
      last = record.arrival - LocalTime{};
      if (!first) first = last;
      if (record.verdict == Verdict::kDrop) {
        ++lost;
      } else {
        delays.push_back(record.release - record.arrival);
      }
    }
    if (!first) continue;
    text += (direction == Direction::kUp ? "up: " : "down: ") + std::to_string(lost + delays.size()) +
            " datagrams from " + duration_text(*first) + " to " + duration_text(last) + ", " + std::to_string(lost) +
            " lost";
    if (!delays.empty()) {
      std::ranges::sort(delays);
      text += "; delay " + duration_text(delays.front()) + " to " + duration_text(delays.back()) + ", median " +
              duration_text(delays[(delays.size() - 1) / 2]);
    }
    text += '\n';
  }
  return text;
}

}  // namespace tendon::injector
