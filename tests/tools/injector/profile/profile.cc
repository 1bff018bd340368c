// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "server/machine/regular_file.h"
#include "tests/tools/injector/models/exact_math.h"
#include "tests/tools/injector/profile/units.h"

namespace tendon::injector {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
constexpr Duration kLongest = std::chrono::hours(24);  // what units.h reads
constexpr std::uint64_t kMaxQueueBytes = std::uint64_t{1} << 30;
constexpr std::uint64_t kMaxQueuePackets = 1'000'000;
constexpr std::uint64_t kMaxRate = 1'000'000'000'000;
constexpr std::size_t kMaxPattern = 65'536;
constexpr std::size_t kMaxName = 32;

[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& expected) {
  throw std::invalid_argument(field + " is " + value + ", expected " + expected);
}

std::string in_quotes(std::string_view text) { return "\"" + std::string(text) + "\""; }

// ---- Limits ---------------------------------------------------------------------------------------------------------

void check_duration(const std::string& field, Duration value, Duration least = {}, Duration most = kMaxDelay) {
  if (value < least || value > most) {
    refuse(field, duration_text(value), duration_text(least) + " to " + duration_text(most));
  }
}

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

/// What is wrong with `entry`, which follows `previous`, if anything.
std::optional<std::string> complaint(const Weighted* previous, const Weighted& entry) {
  if (entry.value < Duration::zero() || entry.value > kMaxDelay) {
    return "value is " + duration_text(entry.value) + ", expected 0ms to " + duration_text(kMaxDelay);
  }
  if (previous != nullptr && entry.value <= previous->value) {
    return "value is " + duration_text(entry.value) + ", expected more than " + duration_text(previous->value) +
           " of the one before it";
  }
  if (!(std::isfinite(entry.weight) && entry.weight >= 0)) {
    return "weight is " + number_text(entry.weight) + ", expected a number that is zero or more";
  }
  return std::nullopt;
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
  /// Beyond that a distribution of one sign is all zeros and 60 s.
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
};

struct LossCheck {
  std::string field;

  void operator()(const RandomLoss& l) const { check_probability(field, l.probability); }
  void operator()(const BurstLoss& l) const {
    check_probability(field, l.probability);
    if (l.probability == 1) refuse(field + "=burst", "100%", "less: bursts need something between them");
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
    if (l.p13 > 0 && l.p31 + l.p32 == 0) refuse(field + "=fourstate: p31 + p32", "0%", "more: nothing ends a burst");
    if (l.p32 > 0 && l.p23 == 0) refuse(field + "=fourstate: p23", "0%", "more: nothing leaves state 2");
    if (l.p13 > 0 && l.p31 == 0) refuse(field + "=fourstate: p31", "0%", "more: nothing leads back to state 1");
  }
  void operator()(const PatternLoss& l) const {
    if (l.pattern.empty() || l.pattern.size() > kMaxPattern || l.pattern.find_first_not_of("01") != std::string::npos) {
      refuse(field + "=pattern", in_quotes(l.pattern), "1 to " + std::to_string(kMaxPattern) + " digits 0 and 1");
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
    if (b.bits_per_second > 0) refuse("rate", std::to_string(b.bits_per_second) + "bit/s", "none beside opportunities");
    if (!std::ranges::is_sorted(b.opportunities_ms)) refuse("opportunities", "not rising", "times in order");
    if (b.opportunities_ms.back() == 0) refuse("opportunities: the last", "0", "more: it is the period");
  }
  const std::uint64_t most = b.queue_in_bytes ? kMaxQueueBytes : kMaxQueuePackets;
  if (b.queue < 1 || b.queue > most) {
    refuse("queue", std::to_string(b.queue) + (b.queue_in_bytes ? "B" : "packets"), "1 to " + std::to_string(most));
  }
  if (b.overhead > 65'535) refuse("overhead", std::to_string(b.overhead), "0 to 65535 bytes");
}

// ---- Writing --------------------------------------------------------------------------------------------------------

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
  static std::string probabilities(const std::string& name, const std::vector<double>& values) {
    std::vector<std::string> texts;
    for (const double p : values) texts.push_back(probability_text(p));
    return call(name, texts);
  }
};

std::string hexadecimal(std::uint8_t byte) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  return {'0', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
}

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

// ---- Reading --------------------------------------------------------------------------------------------------------

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The text up to the first of `separators` outside brackets, taken off `rest` together with the separator.
std::string_view take_until(std::string_view& rest, std::string_view separators) {
  int depth = 0;
  std::size_t end = 0;
  for (; end < rest.size(); ++end) {
    if (depth <= 0 && separators.find(rest[end]) != std::string_view::npos) break;
    depth += rest[end] == '(' ? 1 : rest[end] == ')' ? -1 : 0;
  }
  const std::string_view taken = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return taken;
}

/// "name(a,b)" or "name", with the field it belongs to for complaints.
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

/// Calls `take(line, number)` for each line of a file that holds more than blanks and a comment (#).
template <typename Take>
void for_each_line(const std::filesystem::path& file, const std::string& expected, Take take) {
  std::ifstream in;
  try {
    in = open_regular_file(file);
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(std::string(error.what()) + ", expected " + expected);
  }
  if (in.peek() == std::ifstream::traits_type::eof()) {
    throw std::invalid_argument(file.string() + ": cannot be read or is empty, expected " + expected);
  }
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    const std::string_view line = trimmed(std::string_view(text).substr(0, text.find('#')));
    if (!line.empty()) take(line, file.string() + ":" + std::to_string(number) + ": ");
  }
}

/// VALUE_MS and, after a comma, a semicolon, tabs or blanks, WEIGHT; the weight may be left out if `weightless`.
std::vector<Weighted> table_from_csv(const std::filesystem::path& file, bool weightless) {
  std::vector<Weighted> table;
  for_each_line(file, "one value in ms and its weight in each line", [&](std::string_view line, const std::string& at) {
    std::string_view rest = line;
    const std::optional<double> value_ms = parse_number(take_until(rest, ",; \t"));
    rest = trimmed(rest);
    if (rest.starts_with(',') || rest.starts_with(';')) rest = trimmed(rest.substr(1));
    const std::optional<double> weight = weightless && rest.empty() ? 1.0 : parse_number(rest);
    if (!value_ms || !weight) {
      throw std::invalid_argument(at + "expected " +
                                  (weightless ? "VALUE_MS or VALUE_MS,COUNT" : "LOWER_EDGE_MS,COUNT") +
                                  " like 0.56,72, got " + in_quotes(line));
    }
    const std::optional<Duration> value = to_duration(*value_ms, 1e6);
    if (!value) throw std::invalid_argument(at + "value is " + number_text(*value_ms) + "ms, expected 0ms to 60s");
    const Weighted entry{*value, *weight};
    // Samples come in any order.
    if (const auto wrong = complaint(weightless || table.empty() ? nullptr : &table.back(), entry)) {
      throw std::invalid_argument(at + *wrong);
    }
    if (table.size() == kMaxValues)
      throw std::invalid_argument(at + "expected at most " + std::to_string(kMaxValues) + " values");
    table.push_back(entry);
  });
  return table;
}

/// In order, each value once.
std::vector<Weighted> merged(std::vector<Weighted> values) {
  std::ranges::stable_sort(values, {}, &Weighted::value);
  std::vector<Weighted> result;
  for (const Weighted& entry : values) {
    if (!result.empty() && result.back().value == entry.value) {
      result.back().weight += entry.weight;
    } else {
      result.push_back(entry);
    }
  }
  return result;
}

/// VALUE:WEIGHT,… written out; nothing when the arguments are not that.
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
  return c.name == "samples" ? merged(table_from_csv(file, true)) : table_from_csv(file, false);
}

/// A table of netem (iproute2's *.dist): whole numbers in units of a standard deviation/8192.
SampledDelay netem(const Call& c) {
  c.expect(3, "netem(FILE.dist,MEAN,SD)");
  const Duration mean = duration(c.field + ": mean", c.arguments[1]);
  const Duration deviation = duration(c.field + ": standard deviation", c.arguments[2]);
  check_duration(c.field + ": mean", mean);
  check_duration(c.field + ": standard deviation", deviation);
  std::vector<Weighted> values;
  for_each_line(
      std::filesystem::path(c.arguments[0]), "a table of netem", [&](std::string_view line, const std::string& at) {
        while (!line.empty()) {
          const std::string_view word = take_until(line, kBlanks);
          line = trimmed(line);
          const std::optional<double> entry = parse_number(word);
          if (!entry || std::abs(*entry) > 32'768) {
            throw std::invalid_argument(at + "expected whole numbers from -32768 to 32767, got " + in_quotes(word));
          }
          if (values.size() == kMaxValues) throw std::invalid_argument(at + "expected at most 65536 values");
          const auto units = static_cast<std::int64_t>(*entry);
          values.push_back({std::clamp(mean + deviation * units / 8192, Duration::zero(), kMaxDelay), 1});
        }
      });
  return {merged(std::move(values))};
}

Delay delay(const std::string& field, std::string_view text) {
  const Call c(field, text);
  if (!c.brackets) return ConstantDelay{duration(field, text)};
  if (c.name == "histogram") return HistogramDelay{table(c)};
  if (c.name == "samples") return SampledDelay{table(c)};
  if (c.name == "netem") return netem(c);
  constexpr std::string_view kNames = "uniform normal exponential lognormal pareto gamma";
  if (c.name.empty() || kNames.find(c.name) == std::string_view::npos) {
    refuse(field, in_quotes(c.name),
           "uniform, normal, exponential, lognormal, pareto, gamma, histogram, samples or netem");
  }
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
  refuse(field, in_quotes(c.name),
         "uniform, normal, exponential, lognormal, pareto, gamma, histogram, samples or netem");
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
  refuse(field, in_quotes(c.name), "burst, gilbert, fourstate or pattern");
}

/// The arguments of an event: "key=value" ones by key, and at most one without a key.
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

/// "field=value": false when there is no such field.
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

/// "field(…)": false when there is no such field.
bool add_event(Profile& p, const Call& c) {
  if (c.name == "drop") {
    Arguments a(c, "drop(byte=16,mask=0x0f,value=3,50%)");
    DropRule rule;
    rule.byte = static_cast<std::uint32_t>(whole(a.name("byte"), a.need("byte"), 65'535));
    if (const auto mask = a.take("mask")) rule.mask = static_cast<std::uint8_t>(whole(a.name("mask"), *mask, 255));
    rule.value = static_cast<std::uint8_t>(whole(a.name("value"), a.need("value"), 255));
    if (const auto share = a.take("")) rule.probability = probability(c.field, *share);
    a.end();
    p.rules.push_back(rule);
  } else if (c.name == "regime") {
    Arguments a(c, "regime(NAME,dwell=4s,delay=…,loss=…)");
    Regime regime;
    regime.name = a.need("");
    regime.dwell = a.need_duration("dwell");
    if (const auto text = a.take("delay")) regime.delay = delay(a.name("delay"), *text);
    if (const auto text = a.take("loss")) regime.loss = loss(a.name("loss"), *text);
    a.end();
    p.regimes.push_back(regime);
  } else if (c.name == "step") {
    Arguments a(c, "step(at=5s,20ms)");
    p.steps.push_back({a.need_duration("at"), a.need_duration("")});
    a.end();
  } else if (c.name == "ramp") {
    Arguments a(c, "ramp(from=5s,to=10s,30ms)");
    p.ramps.push_back({a.need_duration("from"), a.need_duration("to"), a.need_duration("")});
    a.end();
  } else if (c.name == "spike") {
    Arguments a(c, "spike(every=15s,for=50ms,80ms)");
    p.spikes.push_back({a.window(), a.need_duration("")});
    a.end();
  } else if (c.name == "stall") {
    Arguments a(c, "stall(every=2s,for=100ms)");
    p.stalls.push_back({a.window()});
    a.end();
  } else if (c.name == "handover") {
    Arguments a(c, "handover(every=15s,for=60ms,10ms)");
    p.handovers.push_back({a.window(), a.need_duration("")});
    a.end();
  } else if (c.name == "outage") {
    Arguments a(c, "outage(at=5s,for=300ms)");
    p.outages.push_back({a.window()});
    a.end();
  } else {
    return false;
  }
  return true;
}

/// "field(…)", at most once: false when there is no such field.
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

void check(const Profile& p) {
  check_duration("base", p.base);
  std::visit(DelayCheck{"delay"}, p.delay);
  check_number("rho", p.rho, 0, 0.999999);
  check_duration("memory", p.memory);
  if (p.memory > Duration::zero()) {
    check_duration("memory", p.memory, std::chrono::microseconds(1));
    if (p.rho != 0) refuse("rho", number_text(p.rho), "0 beside a memory: correlation is by packet or by time");
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
    // Shorter ones would take long to catch up with after a silence.
    check_duration("regime " + r.name + ": dwell", r.dwell, std::chrono::milliseconds(1), kLongest);
    std::visit(DelayCheck{"regime " + r.name + ": delay"}, r.delay);
    if (r.loss) std::visit(LossCheck{"regime " + r.name + ": loss"}, *r.loss);
  }
  for (const std::size_t count :
       {p.steps.size(), p.ramps.size(), p.spikes.size(), p.stalls.size(), p.handovers.size(), p.outages.size()}) {
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
