// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/profile.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "tests/tools/injector/models/exact_math.h"
#include "tests/tools/injector/profile/limits.h"
#include "tests/tools/injector/profile/tables.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {
namespace {

/// "name(a,b)" or "name". `field` is used in error messages.
struct Call {
  std::string field;
  std::string_view text;
  std::string_view name;
  bool brackets = false;
  std::vector<std::string_view> arguments;

  Call(std::string field_of, std::string_view all) : field(std::move(field_of)), text(trimmed(all)) {
    const std::size_t open = text.find('(');
    name = trimmed(text.substr(0, open));
    if (open == std::string_view::npos) return;
    brackets = true;
    if (!text.ends_with(')')) refuse(field, in_quotes(text), "a closing bracket at its end");
    std::string_view inside = text.substr(open + 1, text.size() - open - 2);
    while (!inside.empty()) arguments.push_back(trimmed(take_until(inside, ",")));
  }
  void expect(std::size_t count, const std::string& form) const {
    if (arguments.size() != count) refuse(field, in_quotes(text), form);
  }
};

Duration duration(const std::string& field, std::string_view text) {
  const std::optional<Duration> value = parse_duration(text);
  if (!value) refuse(field, in_quotes(text), "a number with its unit like 20ms (ns, us, ms or s)");
  return *value;
}
double probability(const std::string& field, std::string_view text) {
  const std::optional<double> value = parse_probability(text);
  if (!value) refuse(field, in_quotes(text), "a probability like 2% or 0.02");
  return *value;
}
double number(const std::string& field, std::string_view text) {
  const std::optional<double> value = parse_number(text);
  if (!value) refuse(field, in_quotes(text), "a number");
  return *value;
}
std::uint64_t whole(const std::string& field, std::string_view text, std::uint64_t most) {
  const std::optional<std::uint64_t> value = parse_whole(text);
  if (!value || *value > most) refuse(field, in_quotes(text), "a whole number from 0 to " + std::to_string(most));
  return *value;
}

std::optional<std::vector<Weighted>> inline_table(const Call& c) {
  std::vector<Weighted> table;
  for (std::string_view entry : c.arguments) {
    const std::optional<Duration> value = parse_duration(take_until(entry, ":"));
    const std::optional<double> weight = parse_number(entry);
    if (!value || !weight) return std::nullopt;
    table.push_back({*value, *weight});
  }
  return table;
}

std::vector<Weighted> table(const Call& c) {
  if (auto values = inline_table(c); values && !values->empty()) return *values;
  c.expect(1, "VALUE:WEIGHT like " + std::string(c.name) + "(0.56ms:72,0.59ms:5058), or a file");
  const std::filesystem::path file(c.arguments[0]);
  return c.name == "samples" ? samples_from_csv(file) : histogram_from_csv(file);
}

SampledDelay netem(const Call& c) {
  c.expect(3, "netem(FILE.dist,MEAN,SD)");
  const Duration mean = duration(c.field + ": mean", c.arguments[1]);
  const Duration deviation = duration(c.field + ": standard deviation", c.arguments[2]);
  check_duration(c.field + ": mean", mean);
  check_duration(c.field + ": standard deviation", deviation);
  return {netem_table(c.arguments[0], mean, deviation)};
}

MixtureDelay mixture(const Call& c) {
  const std::string form = "mixture(LEAST,WEIGHT:MEAN,…) like mixture(70ms,0.7:37ms,0.3:12ms)";
  if (c.arguments.size() < 2) refuse(c.field, in_quotes(c.text), form);
  MixtureDelay result{duration(c.field + ": least", c.arguments[0]), {}};
  for (std::size_t i = 1; i < c.arguments.size(); ++i) {
    std::string_view mean = c.arguments[i];
    const std::optional<double> weight = parse_number(take_until(mean, ":"));
    const std::optional<Duration> value = parse_duration(mean);
    if (!weight || !value) refuse(c.field, in_quotes(c.arguments[i]), form);
    result.parts.push_back({*value, *weight});
  }
  return result;
}

Delay delay(const std::string& field, std::string_view text) {
  const Call c(field, text);
  if (!c.brackets) return ConstantDelay{duration(field, text)};
  if (c.name == "histogram") return HistogramDelay{table(c)};
  if (c.name == "samples") return SampledDelay{table(c)};
  if (c.name == "netem") return netem(c);
  if (c.name == "mixture") return mixture(c);
  constexpr const char* kLaws =
      "uniform, normal, exponential, lognormal, pareto, gamma, mixture, histogram, samples or netem";
  constexpr std::string_view kNames = "uniform normal exponential lognormal pareto gamma";
  if (c.name.empty() || kNames.find(c.name) == std::string_view::npos) refuse(field, in_quotes(c.name), kLaws);
  if (c.name == "pareto") {
    c.expect(2, "pareto(LEAST,SHAPE)");
    return ParetoDelay{duration(field + ": least", c.arguments[0]), number(field + ": shape", c.arguments[1])};
  }
  c.expect(2, std::string(c.name) + " of two durations");
  const Duration a = duration(field, c.arguments[0]);
  const Duration b = duration(field, c.arguments[1]);
  if (c.name == "uniform") return UniformDelay{a, b};
  if (c.name == "normal") return NormalDelay{a, b};
  if (c.name == "exponential") return ExponentialDelay{a, b};
  if (c.name == "lognormal") return LognormalDelay{a, b};
  if (c.name == "gamma") return GammaDelay{a, b};
  refuse(field, in_quotes(c.name), kLaws);
}

Loss loss(const std::string& field, std::string_view text) {
  const Call c(field, text);
  if (!c.brackets) return RandomLoss{probability(field, text)};
  const auto p = [&](std::size_t i) { return probability(field, c.arguments[i]); };
  if (c.name == "burst") {
    c.expect(2, "burst(SHARE,MEAN_LENGTH)");
    return BurstLoss{p(0), number(field + ": mean length", c.arguments[1])};
  }
  if (c.name == "gilbert") {
    c.expect(4, "gilbert(P,R,LOSS_IN_B,LOSS_IN_G)");
    return GilbertLoss{p(0), p(1), p(2), p(3)};
  }
  if (c.name == "fourstate") {
    c.expect(5, "fourstate(P13,P31,P32,P23,P14)");
    return FourStateLoss{p(0), p(1), p(2), p(3), p(4)};
  }
  if (c.name == "pattern") {
    c.expect(1, "pattern(0001)");
    return PatternLoss{std::string(c.arguments[0])};
  }
  if (c.name == "bursts") {
    const std::string form = "bursts(pareto2,P12,P21,SHAPE1:SCALE1,SHAPE2:SCALE2)";
    c.expect(5, form);
    if (c.arguments[0] != "pareto2") refuse(field, in_quotes(c.text), form);
    ParetoBurstLoss bursts{p(1), p(2), {}};
    for (std::size_t i = 0; i < 2; ++i) {
      std::string_view scale = c.arguments[3 + i];
      const std::optional<double> shape = parse_number(take_until(scale, ":"));
      const std::optional<double> size = parse_number(scale);
      if (!shape || !size) refuse(field, in_quotes(c.arguments[3 + i]), form);
      bursts.lengths[i] = {*shape, *size};
    }
    return bursts;
  }
  refuse(field, in_quotes(c.name), "burst, bursts, gilbert, fourstate or pattern");
}

/// The arguments of an event: "key=value" pairs, and at most one without a key.
class Arguments {
 public:
  Arguments(const Call& c, std::string form) : call_(c), form_(std::move(form)) {
    for (std::string_view argument : c.arguments) {
      const std::string_view whole_argument = argument;
      const std::string_view key = trimmed(take_until(argument, "="));
      const bool keyed = key.size() < whole_argument.size() && key.find('(') == std::string_view::npos;
      entries_.emplace_back(keyed ? key : std::string_view(), keyed ? trimmed(argument) : whole_argument);
    }
  }
  std::optional<std::string_view> take(std::string_view key) {
    const auto found = std::ranges::find(entries_, key, &Entry::first);
    if (found == entries_.end()) return std::nullopt;
    const std::string_view value = found->second;
    entries_.erase(found);
    return value;
  }
  std::string_view need(std::string_view key) {
    const auto value = take(key);
    if (!value) refuse(call_.field, in_quotes(call_.text), form_);
    return *value;
  }
  std::string name(std::string_view key) const { return call_.field + (key.empty() ? "" : ": " + std::string(key)); }
  Duration need_duration(std::string_view key) { return duration(name(key), need(key)); }
  void end() const {
    if (!entries_.empty()) refuse(call_.field, in_quotes(call_.text), form_);
  }
  Window window() {
    Window w;
    const auto every = take("every");
    if (every) w.every = duration(name("every"), *every);
    const auto at = every ? take("at") : need("at");
    w.at = at ? duration(name("at"), *at) : w.every;
    w.lasts = need_duration("for");
    return w;
  }

 private:
  using Entry = std::pair<std::string_view, std::string_view>;
  const Call& call_;
  std::string form_;
  std::vector<Entry> entries_;
};

std::uint64_t rate(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, double>, 4> kUnits = {
      {{"Gbit/s", 1e9}, {"Mbit/s", 1e6}, {"kbit/s", 1e3}, {"bit/s", 1}}};
  for (const auto& [unit, factor] : kUnits) {
    if (!text.ends_with(unit)) continue;
    const auto value = parse_number(text.substr(0, text.size() - unit.size()));
    if (value && *value * factor >= 1 && *value * factor <= static_cast<double>(kMaxRate)) {
      return static_cast<std::uint64_t>(exact::round(*value * factor));
    }
    break;
  }
  refuse("rate", in_quotes(text),
         "a number with its unit like 10Mbit/s (bit/s, kbit/s, Mbit/s, Gbit/s), at most 1000Gbit/s");
}

void queue(std::string_view text, Bottleneck& b) {
  constexpr std::array<std::pair<std::string_view, std::uint64_t>, 4> kUnits = {
      {{"packets", 1}, {"MB", 1'000'000}, {"kB", 1000}, {"B", 1}}};
  for (const auto& [unit, factor] : kUnits) {
    if (!text.ends_with(unit)) continue;
    const auto value = parse_whole(text.substr(0, text.size() - unit.size()));
    if (!value || *value > kMaxQueueBytes / factor) break;
    b.queue = *value * factor;
    b.queue_in_bytes = unit != "packets";
    return;
  }
  refuse("queue", in_quotes(text), "a number with its unit like 64kB or 50packets (B, kB, MB, packets)");
}

std::vector<std::uint32_t> opportunities(const Call& c) {
  std::vector<std::uint32_t> times;
  const auto take = [&](std::string_view text, const std::string& at) {
    const auto ms = parse_whole(text);
    // A day, as for all times.
    if (!ms || *ms > 86'400'000)
      throw std::invalid_argument(at + "expected a time in whole ms, got " + in_quotes(text));
    if (times.size() == kMaxOpportunities) throw std::invalid_argument(at + "expected at most 1000000 lines");
    times.push_back(static_cast<std::uint32_t>(*ms));
  };
  if (c.arguments.size() == 1 && !parse_whole(c.arguments[0])) {
    for_each_line(std::filesystem::path(c.arguments[0]), "a time in whole ms in each line", take);
  } else {
    for (const std::string_view argument : c.arguments) take(argument, "opportunities: ");
  }
  if (times.empty()) refuse("opportunities", "empty", "times in ms, or a file of them");
  return times;
}

constexpr std::string_view kFields =
    "base, delay, rho, memory, loss, drop(…), regime(…), step(…), ramp(…), spike(…), stall(…), handover(…), outage(…), "
    "duplicate, replay(…), flip, truncate, rebind(…), order, jump(…), rate, opportunities(…), queue or overhead";

bool set_field(Profile& p, const std::string& field, std::string_view value) {
  if (field == "base") {
    p.base = duration(field, value);
  } else if (field == "delay") {
    p.delay = delay(field, value);
  } else if (field == "rho") {
    p.rho = number(field, value);
    p.memory = {};
  } else if (field == "memory") {
    p.memory = duration(field, value);
    p.rho = 0;
  } else if (field == "loss") {
    p.loss = loss(field, value);
  } else if (field == "duplicate") {
    p.duplicate = probability(field, value);
  } else if (field == "flip") {
    p.flip = probability(field, value);
  } else if (field == "truncate") {
    p.truncate = probability(field, value);
  } else if (field == "order") {
    if (value != "fifo" && value != "free") refuse(field, in_quotes(value), "fifo or free");
    p.order = value == "fifo" ? Order::kFifo : Order::kFree;
  } else if (field == "rate") {
    p.bottleneck.bits_per_second = rate(value);
    p.bottleneck.opportunities_ms.clear();
  } else if (field == "queue") {
    queue(value, p.bottleneck);
  } else if (field == "overhead") {
    p.bottleneck.overhead = static_cast<std::uint32_t>(whole(field, value, 65'535));
  } else {
    return false;
  }
  return true;
}

constexpr std::array<std::string_view, 8> kEvents = {"drop(byte=16,mask=0x0f,value=3,50%)",
                                                     "regime(NAME,dwell=4s,delay=…,loss=…)",
                                                     "step(at=5s,20ms)",
                                                     "ramp(from=5s,to=10s,30ms)",
                                                     "spike(every=15s,for=50ms,80ms)",
                                                     "stall(every=2s,for=100ms)",
                                                     "handover(every=15s,for=60ms,10ms)",
                                                     "outage(at=5s,for=300ms) or outage(clear=5s,for=LAW)"};

bool add_event(Profile& p, const Call& c) {
  const auto* const form =
      std::ranges::find_if(kEvents, [&](std::string_view event) { return event.substr(0, event.find('(')) == c.name; });
  if (form == kEvents.end()) return false;
  Arguments a(c, std::string(*form));
  if (c.name == "drop") {
    DropRule rule;
    rule.byte = static_cast<std::uint32_t>(whole(a.name("byte"), a.need("byte"), 65'535));
    if (const auto mask = a.take("mask")) rule.mask = static_cast<std::uint8_t>(whole(a.name("mask"), *mask, 255));
    rule.value = static_cast<std::uint8_t>(whole(a.name("value"), a.need("value"), 255));
    if (const auto share = a.take("")) rule.probability = probability(c.field, *share);
    p.rules.push_back(rule);
  } else if (c.name == "regime") {
    Regime regime;
    regime.name = a.need("");
    regime.dwell = a.need_duration("dwell");
    if (const auto text = a.take("delay")) regime.delay = delay(a.name("delay"), *text);
    if (const auto text = a.take("loss")) regime.loss = loss(a.name("loss"), *text);
    p.regimes.push_back(regime);
  } else if (c.name == "step") {
    p.steps.push_back({a.need_duration("at"), a.need_duration("")});
  } else if (c.name == "ramp") {
    p.ramps.push_back({a.need_duration("from"), a.need_duration("to"), a.need_duration("")});
  } else if (c.name == "spike") {
    p.spikes.push_back({a.window(), a.need_duration("")});
  } else if (c.name == "stall") {
    p.stalls.push_back({a.window()});
  } else if (c.name == "handover") {
    p.handovers.push_back({a.window(), a.need_duration("")});
  } else if (const auto clear = a.take("clear")) {
    p.random_outages.push_back({duration(a.name("clear"), *clear), delay(a.name("for"), a.need("for"))});
  } else {
    p.outages.push_back({a.window()});
  }
  a.end();
  return true;
}

bool set_call(Profile& p, const Call& c) {
  if (c.name == "replay") {
    c.expect(2, "replay(1%,64)");
    p.replay = {probability(c.field, c.arguments[0]),
                static_cast<std::uint32_t>(whole(c.field + ": depth", c.arguments[1], kMaxReplayDepth))};
  } else if (c.name == "jump") {
    c.expect(2, "jump(1%,3)");
    p.jump = {probability(c.field, c.arguments[0]),
              static_cast<std::uint32_t>(whole(c.field + ": places", c.arguments[1], kMaxJump))};
  } else if (c.name == "rebind") {
    Arguments a(c, "rebind(every=10s)");
    p.rebind = a.need_duration("every");
    a.end();
  } else if (c.name == "opportunities") {
    p.bottleneck.opportunities_ms = opportunities(c);
    p.bottleneck.bits_per_second = 0;
  } else {
    return false;
  }
  return true;
}

}  // namespace

Profile parse_profile(std::string_view line) { return parse_profile(line, Profile{}); }

Profile parse_profile(std::string_view line, Profile onto) {
  Profile p = std::move(onto);
  std::vector<std::string> seen;
  while (!(line = trimmed(line)).empty()) {
    const std::string_view item = take_until(line, kBlanks);
    const std::size_t end = item.find_first_of("=(");
    const std::string field(item.substr(0, end));
    if (end != std::string_view::npos) {
      const Call c(field, item[end] == '(' ? item : std::string_view());
      if (c.brackets && add_event(p, c)) continue;
      if (c.brackets ? set_call(p, c) : set_field(p, field, item.substr(end + 1))) {
        if (std::ranges::find(seen, field) != seen.end()) {
          throw std::invalid_argument(field + " is given twice, expected once");
        }
        seen.push_back(field);
        continue;
      }
    }
    refuse("a field of the profile", in_quotes(item), std::string(kFields));
  }
  check(p);
  return p;
}

}  // namespace tendon::injector
