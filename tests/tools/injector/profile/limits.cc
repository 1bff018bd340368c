// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/limits.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {

void check_duration(const std::string& field, Duration value, Duration least, Duration most) {
  if (value < least || value > most) {
    refuse(field, duration_text(value), duration_text(least) + " to " + duration_text(most));
  }
}

std::optional<std::string> complaint(const Weighted* previous, const Weighted& entry) {
  if (entry.value < Duration::zero() || entry.value > kMaxDelay) {
    return "value is " + duration_text(entry.value) + ", expected 0ms to " + duration_text(kMaxDelay);
  }
  if (previous != nullptr && entry.value <= previous->value) {
    return "value is " + duration_text(entry.value) + ", expected more than " + duration_text(previous->value) +
           ", the previous one";
  }
  if (!(std::isfinite(entry.weight) && entry.weight >= 0)) {
    return "weight is " + number_text(entry.weight) + ", expected a number that is zero or more";
  }
  return std::nullopt;
}

namespace {

constexpr Duration kLongest = std::chrono::hours(24);  // limit of units.h
constexpr std::uint64_t kMaxQueuePackets = 1'000'000;
constexpr std::size_t kMaxPattern = 65'536;
constexpr std::size_t kMaxName = 32;

void check_probability(const std::string& field, double value) {
  if (!(value >= 0 && value <= 1)) refuse(field, probability_text(value), "a probability from 0% to 100%");
}

void check_number(const std::string& field, double value, double least, double most) {
  if (!(value >= least && value <= most)) {
    refuse(field, number_text(value), number_text(least) + " to " + number_text(most));
  }
}

void check_count(const std::string& field, std::size_t count, std::size_t most, const std::string& of) {
  if (count > most) refuse(field, std::to_string(count) + " " + of, "at most " + std::to_string(most));
}

void check_table(const std::string& field, const std::vector<Weighted>& table) {
  check_count(field, table.size(), kMaxValues, "values");
  double total = 0;
  const Weighted* previous = nullptr;
  for (const Weighted& entry : table) {
    if (const auto wrong = complaint(previous, entry)) {
      throw std::invalid_argument(field + ", entry " + std::to_string(&entry - table.data()) + ": " + *wrong);
    }
    previous = &entry;
    total += entry.weight;
  }
  if (!(std::isfinite(total) && total > 0)) {
    refuse(field + ": the sum of all weights", number_text(total), "a finite number above zero");
  }
}

struct DelayCheck {
  std::string field;

  void mean_and_deviation(Duration mean, Duration deviation) const {
    check_duration(field + ": mean", mean);
    check_duration(field + ": standard deviation", deviation);
  }
  /// Beyond this, a distribution with a fixed lower bound would consist of zeros and 60 s.
  void shaped(Duration mean, Duration deviation) const {
    check_duration(field + ": mean", mean, Duration(1));
    const Duration least = (mean + Duration(99)) / 100;
    check_duration(field + ": standard deviation", deviation, least, std::min(kMaxDelay, mean * 10));
  }
  void operator()(const ConstantDelay& d) const { check_duration(field, d.value); }
  void operator()(const UniformDelay& d) const {
    check_duration(field + ": lower end", d.low);
    check_duration(field + ": upper end", d.high, d.low);
  }
  void operator()(const NormalDelay& d) const { mean_and_deviation(d.mean, d.deviation); }
  void operator()(const ExponentialDelay& d) const {
    check_duration(field + ": least", d.least);
    check_duration(field + ": mean", d.mean, d.least);
  }
  void operator()(const LognormalDelay& d) const { shaped(d.mean, d.deviation); }
  void operator()(const ParetoDelay& d) const {
    check_duration(field + ": least", d.least);
    check_number(field + ": shape", d.shape, 0.1, 100);
  }
  void operator()(const GammaDelay& d) const { shaped(d.mean, d.deviation); }
  void operator()(const HistogramDelay& d) const { check_table(field + "=histogram", d.bins); }
  void operator()(const SampledDelay& d) const { check_table(field + "=samples", d.values); }
  void operator()(const MixtureDelay& d) const {
    const std::string name = field + "=mixture";
    check_duration(name + ": least", d.least);
    check_count(name, d.parts.size(), kMaxParts, "parts");
    if (d.parts.empty()) refuse(name, "without parts", "one or more");
    for (const Weighted& part : d.parts) {
      check_duration(name + ": mean", part.value, Duration(1));
      check_number(name + ": weight", part.weight, 1e-9, 1e9);
    }
  }
};

struct LossCheck {
  std::string field;

  void operator()(const RandomLoss& l) const { check_probability(field, l.probability); }
  void operator()(const BurstLoss& l) const {
    check_probability(field, l.probability);
    if (l.probability == 1) refuse(field + "=burst", "100%", "less, because there must be gaps between bursts");
    // Otherwise P(G→B) = p/(1 − p)/L would be above 1.
    check_number(field + "=burst: mean length", l.length, std::max(1.0, l.probability / (1 - l.probability)), 1e6);
  }
  void operator()(const GilbertLoss& l) const {
    check_probability(field + "=gilbert: P(G to B)", l.to_bad);
    check_probability(field + "=gilbert: P(B to G)", l.to_good);
    check_probability(field + "=gilbert: loss in B", l.lost_in_bad);
    check_probability(field + "=gilbert: loss in G", l.lost_in_good);
  }
  void operator()(const FourStateLoss& l) const {
    for (const double p : {l.p13, l.p31, l.p32, l.p23, l.p14}) check_probability(field + "=fourstate", p);
    check_probability(field + "=fourstate: p13 + p14", l.p13 + l.p14);
    check_probability(field + "=fourstate: p31 + p32", l.p31 + l.p32);
    if (l.p13 > 0 && l.p31 + l.p32 == 0)
      refuse(field + "=fourstate: p31 + p32", "0%", "more, because bursts would not end");
    if (l.p32 > 0 && l.p23 == 0) refuse(field + "=fourstate: p23", "0%", "more, because state 2 would not end");
    if (l.p13 > 0 && l.p31 == 0)
      refuse(field + "=fourstate: p31", "0%", "more, because state 1 would not be reached again");
  }
  void operator()(const PatternLoss& l) const {
    if (l.pattern.empty() || l.pattern.size() > kMaxPattern || l.pattern.find_first_not_of("01") != std::string::npos) {
      refuse(field + "=pattern", in_quotes(l.pattern), "1 to " + std::to_string(kMaxPattern) + " digits 0 and 1");
    }
  }
  void operator()(const ParetoBurstLoss& l) const {
    check_probability(field + "=bursts: P12", l.p12);
    check_probability(field + "=bursts: P21", l.p21);
    for (const auto& [shape, scale] : l.lengths) {
      check_number(field + "=bursts: shape", shape, 1, 100);
      check_number(field + "=bursts: scale", scale, 0, 1e4);
    }
  }
};

void check_window(const std::string& field, const Window& w) {
  check_duration(field + ": at", w.at, {}, kLongest);
  check_duration(field + ": every", w.every, {}, kLongest);
  check_duration(field + ": for", w.lasts, Duration(1), w.every > Duration::zero() ? w.every - Duration(1) : kLongest);
  if (w.every > Duration::zero() && w.every < std::chrono::microseconds(1)) {
    refuse(field + ": every", duration_text(w.every), "0.001ms or more");
  }
}

void check_bottleneck(const Bottleneck& b) {
  if (b.bits_per_second > kMaxRate) refuse("rate", std::to_string(b.bits_per_second) + "bit/s", "at most 1000Gbit/s");
  check_count("opportunities", b.opportunities_ms.size(), kMaxOpportunities, "lines");
  if (!b.opportunities_ms.empty()) {
    if (b.bits_per_second > 0) refuse("rate", std::to_string(b.bits_per_second) + "bit/s", "none with opportunities");
    if (!std::ranges::is_sorted(b.opportunities_ms)) refuse("opportunities", "not rising", "times in order");
    if (b.opportunities_ms.back() == 0) refuse("opportunities: the last", "0", "more, because it is the period");
  }
  const std::uint64_t most = b.queue_in_bytes ? kMaxQueueBytes : kMaxQueuePackets;
  if (b.queue < 1 || b.queue > most) {
    refuse("queue", std::to_string(b.queue) + (b.queue_in_bytes ? "B" : "packets"), "1 to " + std::to_string(most));
  }
  if (b.overhead > 65'535) refuse("overhead", std::to_string(b.overhead), "0 to 65535 bytes");
}

}  // namespace

void check(const Profile& p) {
  check_duration("base", p.base);
  std::visit(DelayCheck{"delay"}, p.delay);
  check_number("rho", p.rho, 0, 0.999999);
  check_duration("memory", p.memory);
  if (p.memory > Duration::zero()) {
    check_duration("memory", p.memory, std::chrono::microseconds(1));
    if (p.rho != 0)
      refuse("rho", number_text(p.rho), "0 if memory is set, because the correlation is either by packet or by time");
  }
  std::visit(LossCheck{"loss"}, p.loss);

  check_count("drop", p.rules.size(), kMaxEvents, "rules");
  for (const DropRule& rule : p.rules) {
    if (rule.byte > 65'535) refuse("drop: byte", std::to_string(rule.byte), "0 to 65535");
    check_probability("drop", rule.probability);
    if ((rule.value & ~rule.mask) != 0) {
      refuse("drop: value", hexadecimal(rule.value), "bits within the mask " + hexadecimal(rule.mask));
    }
  }
  if (p.regimes.size() == 1) refuse("regime", "one", "two or more, or none");
  check_count("regime", p.regimes.size(), kMaxEvents, "regimes");
  for (const Regime& r : p.regimes) {
    if (r.name.empty() || r.name.size() > kMaxName || r.name.find_first_of(" \t\r\n,()=\"") != std::string::npos) {
      refuse("regime: name", in_quotes(r.name), "a word of 1 to 32 letters");
    }
    // Shorter dwell times make catching up after a silence slow.
    check_duration("regime " + r.name + ": dwell", r.dwell, std::chrono::milliseconds(1), kLongest);
    std::visit(DelayCheck{"regime " + r.name + ": delay"}, r.delay);
    if (r.loss) std::visit(LossCheck{"regime " + r.name + ": loss"}, *r.loss);
  }
  for (const std::size_t count : {p.steps.size(), p.ramps.size(), p.spikes.size(), p.stalls.size(), p.handovers.size(),
                                  p.outages.size(), p.random_outages.size()}) {
    check_count("step, ramp, spike, stall, handover or outage", count, kMaxEvents, "events");
  }
  for (const Step& s : p.steps) {
    check_duration("step: at", s.at, {}, kLongest);
    check_duration("step", s.change, -kMaxDelay);
  }
  for (const Ramp& r : p.ramps) {
    check_duration("ramp: from", r.from, {}, kLongest);
    check_duration("ramp: to", r.to, r.from + Duration(1), kLongest);
    check_duration("ramp", r.change, -kMaxDelay);
  }
  for (const Spike& s : p.spikes) {
    check_window("spike", s.when);
    check_duration("spike", s.extra);
  }
  for (const Stall& s : p.stalls) {
    check_window("stall", s.when);
    check_duration("stall: for", s.when.lasts);
  }
  for (const Handover& h : p.handovers) {
    check_window("handover", h.when);
    check_duration("handover", h.change);
  }
  for (const Outage& o : p.outages) check_window("outage", o.when);
  for (const RandomOutage& o : p.random_outages) {
    // As for the dwell time of a regime.
    check_duration("outage: clear", o.clear, std::chrono::milliseconds(1), kLongest);
    std::visit(DelayCheck{"outage: for"}, o.length);
  }

  check_probability("duplicate", p.duplicate);
  check_probability("replay", p.replay.probability);
  if (p.replay.depth > kMaxReplayDepth || (p.replay.depth == 0) != (p.replay.probability == 0)) {
    refuse("replay: depth", std::to_string(p.replay.depth), "1 to 64 with a probability above zero");
  }
  check_probability("flip", p.flip);
  check_probability("truncate", p.truncate);
  if (p.rebind != Duration::zero()) check_duration("rebind: every", p.rebind, std::chrono::milliseconds(1), kLongest);
  check_probability("jump", p.jump.probability);
  if (p.jump.places > kMaxJump || (p.jump.places == 0) != (p.jump.probability == 0)) {
    refuse("jump: places", std::to_string(p.jump.places), "1 to 64 with a probability above zero");
  }
  check_bottleneck(p.bottleneck);
}

}  // namespace tendon::injector
