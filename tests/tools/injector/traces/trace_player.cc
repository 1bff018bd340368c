// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/trace_player.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

namespace tendon::injector {
namespace {

template <class Keep>
Duration median(const std::vector<TraceRecord>& records, const Keep& keep) {
  std::vector<Duration> delays;
  for (const TraceRecord& record : records) {
    if (record.verdict != Verdict::kDrop && keep(record)) delays.push_back(record.release - record.arrival);
  }
  if (delays.empty()) return Duration::zero();
  const auto middle = delays.begin() + static_cast<std::ptrdiff_t>((delays.size() - 1) / 2);
  std::ranges::nth_element(delays, middle);
  return *middle;
}

std::uint32_t recorded_link(const Trace& trace, std::uint32_t link) {
  std::set<std::uint32_t> links;
  for (const TraceRecord& record : trace.records) links.insert(record.link);
  if (links.empty() || links.contains(link)) return link;
  return *std::next(links.begin(), static_cast<std::ptrdiff_t>(link % links.size()));
}

}  // namespace

bool reorders(const Trace& trace, Direction direction) {
  std::set<std::uint32_t> links;
  for (const TraceRecord& record : trace.records) links.insert(record.link);
  return std::ranges::any_of(links, [&](std::uint32_t link) {
    return !TracePlayer(trace, direction, link, TracePlayer::By::kIndex).in_order();
  });
}

Duration median_delay(const Trace& trace, Direction direction) {
  return median(trace.records, [direction](const TraceRecord& record) { return record.direction == direction; });
}

TracePlayer::TracePlayer(const Trace& trace, Direction direction, std::uint32_t link, By by, LocalTime start,
                         AtEnd at_end)
    : by_(by), start_(start), recorded_start_(trace.start), at_end_(at_end), wraps_(!trace.sparse()) {
  if (by == By::kTime && trace.sparse()) {
    throw std::invalid_argument("a sparse trace can only be replayed by index");
  }
  const std::uint32_t wanted = recorded_link(trace, link);
  for (const TraceRecord& record : trace.records) {
    if (record.direction == direction && record.link == wanted) records_.push_back(record);
  }
  std::ranges::sort(records_, {}, &TraceRecord::index);

  benign_ = trace.sparse() ? trace.benign[static_cast<std::size_t>(direction)].value_or(Duration::zero())
                           : median(records_, [](const TraceRecord&) { return true; });
  if (records_.empty()) {
    wraps_ = false;
    return;
  }
  LocalTime newest = LocalTime::min();
  for (const TraceRecord& record : records_) {
    if (record.verdict == Verdict::kDrop) continue;
    in_order_ = in_order_ && record.release >= newest;
    newest = record.release;
  }
  length_ = records_.back().index + 1;
  const auto [first, last] = std::ranges::minmax(trace.records, {}, &TraceRecord::arrival);
  const auto distances = static_cast<std::int64_t>(std::max<std::size_t>(trace.records.size() - 1, 1));
  period_ = std::max(last.arrival - recorded_start_ + (last.arrival - first.arrival) / distances, Duration(1));
}

void TracePlayer::add(Injector network) { network_.emplace(std::move(network)); }

bool TracePlayer::ended(LocalTime arrival) const {
  if (!wraps_) return false;
  return by_ == By::kIndex ? next_index_ >= length_ : arrival - start_ >= period_;
}

bool TracePlayer::stops(LocalTime arrival) const { return at_end_ == AtEnd::kStop && ended(arrival); }

double TracePlayer::played() const {
  if (!wraps_ || next_index_ == 0) return 0;
  const double times = by_ == By::kIndex ? static_cast<double>(next_index_) / static_cast<double>(length_)
                                         : std::max(seconds(last_arrival_ - start_), 0.0) / seconds(period_);
  return at_end_ == AtEnd::kRepeat ? times : std::min(times, 1.0);
}

TracePlayer::Found TracePlayer::find_by_index(std::uint64_t index) {
  if (records_.empty()) return {};
  const std::uint64_t cycle = wraps_ ? index / length_ : 0;
  const std::uint64_t wanted = wraps_ ? index % length_ : index;
  if (wanted == 0) cursor_ = 0;
  while (cursor_ < records_.size() && records_[cursor_].index < wanted) ++cursor_;
  const bool there = cursor_ < records_.size() && records_[cursor_].index == wanted;
  return {there ? &records_[cursor_] : nullptr, cycle};
}

TracePlayer::Found TracePlayer::find_by_time(LocalTime arrival) const {
  if (records_.empty()) return {};
  const Duration since = std::max(arrival - start_, Duration::zero());
  const LocalTime then = recorded_start_ + since % period_;
  const auto after = std::ranges::upper_bound(records_, then, {}, &TraceRecord::arrival);
  const TraceRecord* const record = after == records_.begin() ? &*after : &*std::prev(after);
  return {record, static_cast<std::uint64_t>(since / period_)};
}

Decision TracePlayer::decide(const Packet& packet) {
  const Decision first = of_trace(packet);
  return network_ ? through_network(first, packet) : first;
}

Decision TracePlayer::through_network(Decision d, const Packet& packet) {
  const bool lost = d.verdict == Verdict::kDrop;
  // The release of a lost datagram can be later than that of the next one, for example in an imported trace.
  const LocalTime entry = lost ? std::max(packet.arrival, last_entry_) : d.release;
  last_entry_ = std::max(last_entry_, entry);
  const Decision second = network_->decide({.arrival = entry, .size = packet.size, .bytes = packet.bytes});
  const Duration later = second.release - entry;
  if (!lost && (second.verdict == Verdict::kDrop || later > Duration::zero())) d.cause = second.cause;
  if (second.verdict == Verdict::kDrop) {
    d.verdict = Verdict::kDrop;
    d.duplicate.reset();
  } else if (d.duplicate) {
    *d.duplicate += later;
  } else if (!lost) {
    d.verdict = second.verdict;
    d.duplicate = second.duplicate;
  }
  d.release += later;
  if (d.stale) {
    d.stale->release += later;
  } else {
    d.stale = second.stale;
  }
  if (!d.flipped_bit) d.flipped_bit = second.flipped_bit;
  if (second.truncated_to) d.truncated_to = std::min(*second.truncated_to, d.truncated_to.value_or(UINT32_MAX));
  d.rebinds += second.rebinds;
  return d;
}

Decision TracePlayer::of_trace(const Packet& packet) {
  const bool passes = at_end_ != AtEnd::kRepeat && ended(packet.arrival);
  const std::uint64_t index = next_index_++;
  last_arrival_ = packet.arrival;
  const Found found = passes ? Found{} : by_ == By::kIndex ? find_by_index(index) : find_by_time(packet.arrival);

  Decision decision;
  decision.cause = Cause::kReplay;
  decision.release = packet.arrival + (passes ? Duration::zero() : benign_);
  if (found.record != nullptr) {
    decision = *found.record;
    const auto moved = [&](LocalTime at) { return packet.arrival + (at - found.record->arrival); };
    decision.release = moved(decision.release);
    if (decision.duplicate) decision.duplicate = moved(*decision.duplicate);
    if (decision.stale) decision.stale->release = moved(decision.stale->release);
    // Keeps increasing across cycles, because a driver changes its port when the number increases.
    rebinds_ = static_cast<std::uint32_t>(found.cycle * records_.back().rebinds + found.record->rebinds);
  }
  decision.index = index;
  decision.arrival = packet.arrival;
  decision.size = packet.size;
  decision.rebinds = rebinds_;
  if (decision.verdict == Verdict::kDrop) return decision;

  if (in_order_ && decision.release < last_release_) decision.release = last_release_;
  if (decision.duplicate) decision.duplicate = std::max(*decision.duplicate, decision.release);
  last_release_ = decision.release;
  return decision;
}

}  // namespace tendon::injector
