// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {
namespace {

std::string call(const std::string& name, const std::vector<std::string>& arguments) {
  std::string text = name + "(";
  for (const std::string& argument : arguments) text += (&argument == arguments.data() ? "" : ",") + argument;
  return text + ")";
}

std::string table_text(const std::string& name, const std::vector<Weighted>& table) {
  std::vector<std::string> entries;
  entries.reserve(table.size());
  for (const Weighted& e : table) entries.push_back(duration_text(e.value) + ":" + number_text(e.weight));
  return call(name, entries);
}

struct DelayText {
  std::string operator()(const ConstantDelay& d) const { return duration_text(d.value); }
  std::string operator()(const UniformDelay& d) const { return two("uniform", d.low, d.high); }
  std::string operator()(const NormalDelay& d) const { return two("normal", d.mean, d.deviation); }
  std::string operator()(const ExponentialDelay& d) const { return two("exponential", d.least, d.mean); }
  std::string operator()(const LognormalDelay& d) const { return two("lognormal", d.mean, d.deviation); }
  std::string operator()(const ParetoDelay& d) const {
    return call("pareto", {duration_text(d.least), number_text(d.shape)});
  }
  std::string operator()(const GammaDelay& d) const { return two("gamma", d.mean, d.deviation); }
  std::string operator()(const HistogramDelay& d) const { return table_text("histogram", d.bins); }
  std::string operator()(const SampledDelay& d) const { return table_text("samples", d.values); }
  std::string operator()(const MixtureDelay& d) const {
    std::vector<std::string> arguments = {duration_text(d.least)};
    for (const Weighted& part : d.parts)
      arguments.push_back(number_text(part.weight) + ":" + duration_text(part.value));
    return call("mixture", arguments);
  }
  static std::string two(const std::string& name, Duration a, Duration b) {
    return call(name, {duration_text(a), duration_text(b)});
  }
};

struct LossText {
  std::string operator()(const RandomLoss& l) const { return probability_text(l.probability); }
  std::string operator()(const BurstLoss& l) const {
    return call("burst", {probability_text(l.probability), number_text(l.length)});
  }
  std::string operator()(const GilbertLoss& l) const {
    return probabilities("gilbert", {l.to_bad, l.to_good, l.lost_in_bad, l.lost_in_good});
  }
  std::string operator()(const FourStateLoss& l) const {
    return probabilities("fourstate", {l.p13, l.p31, l.p32, l.p23, l.p14});
  }
  std::string operator()(const PatternLoss& l) const { return "pattern(" + l.pattern + ")"; }
  std::string operator()(const ParetoBurstLoss& l) const {
    std::vector<std::string> arguments = {"pareto2", probability_text(l.p12), probability_text(l.p21)};
    for (const auto& [shape, scale] : l.lengths) arguments.push_back(number_text(shape) + ":" + number_text(scale));
    return call("bursts", arguments);
  }
  static std::string probabilities(const std::string& name, const std::vector<double>& values) {
    std::vector<std::string> texts;
    for (const double p : values) texts.push_back(probability_text(p));
    return call(name, texts);
  }
};

std::vector<std::string> window_text(const Window& w, std::vector<std::string> more = {}) {
  std::vector<std::string> parts;
  if (w.at != w.every) parts.push_back("at=" + duration_text(w.at));
  if (w.every > Duration::zero()) parts.push_back("every=" + duration_text(w.every));
  if (parts.empty()) parts.push_back("at=" + duration_text(w.at));
  parts.push_back("for=" + duration_text(w.lasts));
  parts.insert(parts.end(), more.begin(), more.end());
  return parts;
}

std::string rate_text(std::uint64_t bits_per_second) {
  constexpr std::array<std::pair<std::uint64_t, const char*>, 3> kUnits = {
      {{1'000'000'000, "Gbit/s"}, {1'000'000, "Mbit/s"}, {1000, "kbit/s"}}};
  for (const auto& [unit, name] : kUnits) {
    if (bits_per_second % unit == 0) return std::to_string(bits_per_second / unit) + name;
  }
  return std::to_string(bits_per_second) + "bit/s";
}

std::string queue_text(const Bottleneck& b) {
  if (!b.queue_in_bytes) return std::to_string(b.queue) + "packets";
  if (b.queue % 1'000'000 == 0) return std::to_string(b.queue / 1'000'000) + "MB";
  if (b.queue % 1000 == 0) return std::to_string(b.queue / 1000) + "kB";
  return std::to_string(b.queue) + "B";
}

}  // namespace

std::string to_string(const Profile& p) {
  std::string line;
  const auto add = [&line](const std::string& text) { line += (line.empty() ? "" : " ") + text; };
  const Profile plain;
  if (p.base != plain.base || p == plain) add("base=" + duration_text(p.base));
  if (p.delay != plain.delay) add("delay=" + std::visit(DelayText{}, p.delay));
  if (p.rho != 0) add("rho=" + number_text(p.rho));
  if (p.memory != Duration::zero()) add("memory=" + duration_text(p.memory));
  if (p.loss != plain.loss) add("loss=" + std::visit(LossText{}, p.loss));
  for (const DropRule& rule : p.rules) {
    add(call("drop", {"byte=" + std::to_string(rule.byte), "mask=" + hexadecimal(rule.mask),
                      "value=" + hexadecimal(rule.value), probability_text(rule.probability)}));
  }
  for (const Regime& r : p.regimes) {
    std::vector<std::string> parts = {r.name, "dwell=" + duration_text(r.dwell)};
    if (r.delay != Delay{}) parts.push_back("delay=" + std::visit(DelayText{}, r.delay));
    if (r.loss) parts.push_back("loss=" + std::visit(LossText{}, *r.loss));
    add(call("regime", parts));
  }
  for (const Step& s : p.steps) add(call("step", {"at=" + duration_text(s.at), duration_text(s.change)}));
  for (const Ramp& r : p.ramps) {
    add(call("ramp", {"from=" + duration_text(r.from), "to=" + duration_text(r.to), duration_text(r.change)}));
  }
  for (const Spike& s : p.spikes) add(call("spike", window_text(s.when, {duration_text(s.extra)})));
  for (const Stall& s : p.stalls) add(call("stall", window_text(s.when)));
  for (const Handover& h : p.handovers) add(call("handover", window_text(h.when, {duration_text(h.change)})));
  for (const Outage& o : p.outages) add(call("outage", window_text(o.when)));
  for (const RandomOutage& o : p.random_outages) {
    add(call("outage", {"clear=" + duration_text(o.clear), "for=" + std::visit(DelayText{}, o.length)}));
  }
  if (p.duplicate != 0) add("duplicate=" + probability_text(p.duplicate));
  if (p.replay != plain.replay) {
    add(call("replay", {probability_text(p.replay.probability), std::to_string(p.replay.depth)}));
  }
  if (p.flip != 0) add("flip=" + probability_text(p.flip));
  if (p.truncate != 0) add("truncate=" + probability_text(p.truncate));
  if (p.rebind != Duration::zero()) add("rebind(every=" + duration_text(p.rebind) + ")");
  if (p.order == Order::kFree) add("order=free");
  if (p.jump != plain.jump) add(call("jump", {probability_text(p.jump.probability), std::to_string(p.jump.places)}));
  if (p.bottleneck.bits_per_second > 0) add("rate=" + rate_text(p.bottleneck.bits_per_second));
  if (!p.bottleneck.opportunities_ms.empty()) {
    std::vector<std::string> times;
    for (const std::uint32_t ms : p.bottleneck.opportunities_ms) times.push_back(std::to_string(ms));
    add(call("opportunities", times));
  }
  if (p.bottleneck.queue != plain.bottleneck.queue || p.bottleneck.queue_in_bytes)
    add("queue=" + queue_text(p.bottleneck));
  if (p.bottleneck.overhead != plain.bottleneck.overhead) add("overhead=" + std::to_string(p.bottleneck.overhead));
  return line;
}

}  // namespace tendon::injector
