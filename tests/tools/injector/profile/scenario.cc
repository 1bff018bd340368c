// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/scenario.h"

#include <toml++/toml.h>

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <stdexcept>

#include "core/base/nearest_word.h"
#include "server/machine/regular_file.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {
namespace {

constexpr std::size_t kMaxScenarioBytes = std::size_t{32} << 20;  // profiles may contain inline tables

void set_profiles(Change& change, std::string_view key, std::string_view profile) {
  if (key != "down") change.up = resolve_profile(profile, Direction::kUp);
  if (key != "up") change.down = resolve_profile(profile, Direction::kDown);
}

void append(std::string& text, std::string_view key, std::string_view value) {
  if (!text.empty()) text += ", ";
  text.append(key).append(" ").append(value);
  // The text must fit into a single line of the trace.
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
}

/// One table of a file. Errors are exceptions that name file, line and key.
class Keys {
 public:
  Keys(const std::string& file, const toml::table& table, std::string path)
      : file_(file), table_(table), path_(std::move(path)) {}

  void refuse_others_than(std::initializer_list<std::string_view> known) const {
    for (const auto& [key, node] : table_) {
      if (std::ranges::find(known, key.str()) != known.end()) continue;
      std::string all = did_you_mean(key.str(), known);
      if (all.empty()) {
        for (const std::string_view name : known) all.append(all.empty() ? "; expected one of " : ", ").append(name);
      }
      fail(node, key.str(), (node.is_table() ? "unknown table" : "unknown key") + all);
    }
  }

  const toml::node* find(std::string_view key) const { return table_.get(key); }

  std::optional<std::string> text(std::string_view key) const {
    const toml::node* const node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_string()) fail(*node, key, "expected text in quotes");
    return **node->as_string();
  }

  std::optional<std::int64_t> whole(std::string_view key, std::int64_t most) const {
    const toml::node* const node = find(key);
    if (node == nullptr) return std::nullopt;
    const auto* const value = node->as_integer();
    if (value == nullptr || **value < 0 || **value > most) {
      fail(*node, key, "expected a whole number from 0 to " + std::to_string(most));
    }
    return **value;
  }

  /// `unit_ns` is the unit in the key's suffix. At most one day.
  std::optional<Duration> duration(std::string_view key, double unit_ns, bool may_be_negative) const {
    const std::optional<double> value = number(key);
    if (!value) return std::nullopt;
    const std::optional<Duration> duration = to_duration(*value, unit_ns);
    if (!duration || (!may_be_negative && *duration < Duration::zero())) {
      fail(*find(key), key, may_be_negative ? "expected at most a day" : "expected 0 or more, and at most a day");
    }
    return duration;
  }

  std::optional<double> number(std::string_view key) const {
    const toml::node* const node = find(key);
    if (node == nullptr) return std::nullopt;
    const std::optional<double> value = node->value<double>();
    if (!value || !(*value > -1e15 && *value < 1e15)) fail(*node, key, "expected a number");
    return value;
  }

  /// Calls `take` for the tables of an array [[key]], if it exists.
  template <class Take>
  void each(std::string_view key, std::size_t most, const Take& take) const {
    const toml::node* const node = find(key);
    if (node == nullptr) return;
    const toml::array* const array = node->as_array();
    if (array == nullptr) fail(*node, key, "expected tables [[" + joined(key) + "]]");
    if (array->size() > most) fail(*node, key, "expected at most " + std::to_string(most) + " of them");
    for (const toml::node& element : *array) {
      if (!element.is_table()) fail(element, key, "expected tables [[" + joined(key) + "]]");
      take(Keys(file_, *element.as_table(), joined(key)));
    }
  }

  Change profiles() const {
    Change change;
    for (const std::string_view key : {"both", "up", "down"}) {
      const std::optional<std::string> profile = text(key);
      if (!profile) continue;
      if (key != "both" && find("both") != nullptr) fail(*find(key), key, "expected either both, or up and down");
      try {
        set_profiles(change, key, *profile);
      } catch (const std::invalid_argument& refused) {
        fail(*find(key), key, refused.what());
      }
      append(change.text, key, *profile);
    }
    return change;
  }

  [[noreturn]] void fail(const toml::node& node, std::string_view key, const std::string& sentence) const {
    fail_at(node.source().begin.line, joined(key) + ": " + sentence);
  }
  [[noreturn]] void fail(const std::string& sentence) const {
    fail_at(table_.source().begin.line, path_ + ": " + sentence);
  }

 private:
  std::string joined(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + '.' + std::string(key);
  }
  [[noreturn]] void fail_at(std::uint32_t line, const std::string& sentence) const {
    throw std::runtime_error(file_ + ':' + std::to_string(line) + ": " + sentence);
  }

  const std::string& file_;
  const toml::table& table_;
  std::string path_;
};

DriftingClock::Config clock_of(const Keys& keys) {
  keys.refuse_others_than({"offset_ms", "drift_ppm", "step"});
  DriftingClock::Config config;
  config.offset = keys.duration("offset_ms", 1e6, true).value_or(Duration::zero());
  const double ppb = keys.number("drift_ppm").value_or(0) * 1000;
  config.drift_ppb = static_cast<std::int64_t>(ppb + (ppb < 0 ? -0.5 : 0.5));
  keys.each("step", DriftingClock::kMaxSteps, [&config](const Keys& step) {
    step.refuse_others_than({"t_s", "step_ms"});
    const auto at = step.duration("t_s", 1e9, false);
    const auto change = step.duration("step_ms", 1e6, true);
    if (!at || !change) step.fail("expected t_s and step_ms");
    config.steps.push_back({*at, *change});
  });
  try {
    DriftingClock{config};
  } catch (const std::invalid_argument& refused) {
    keys.fail(refused.what());
  }
  return config;
}

Scenario::Timed timed_of(const Keys& keys) {
  keys.refuse_others_than({"t_s", "up", "down", "both", "link", "note"});
  const auto at = keys.duration("t_s", 1e9, false);
  if (!at) keys.fail("t_s: expected the time since the start, s, found nothing");
  Change change = keys.profiles();
  if (const auto link = keys.whole("link", kMaxLink)) {
    if (!change.up && !change.down) keys.fail(*keys.find("link"), "link", "expected up, down or both with it");
    change.link = static_cast<std::uint32_t>(*link);
    change.text = "link " + std::to_string(*link) + ' ' + change.text;
  }
  if (const auto note = keys.text("note")) append(change.text, "note", *note);
  if (change.text.empty()) keys.fail("expected up, down, both or note");
  return {*at, std::move(change)};
}

struct Words {
  std::string_view first, rest;
};
Words split(std::string_view text) {
  text = trimmed(text);
  const std::string_view first = text.substr(0, text.find_first_of(kBlanks));
  text.remove_prefix(first.size());
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return {first, text};
}

bool is_way(std::string_view word) { return word == "up" || word == "down" || word == "both"; }

Change change_of(std::string_view way, std::string_view profile) {
  if (profile.empty()) {
    throw std::invalid_argument(in_quotes(way) +
                                " without a profile, expected one like delay=20ms or a name: " + names_of_profiles());
  }
  Change change;
  set_profiles(change, way, profile);
  append(change.text, way, profile);
  return change;
}

}  // namespace

Scenario parse_scenario(std::string_view toml, const std::string& name) {
  if (toml.size() > kMaxScenarioBytes) throw std::runtime_error(name + ": expected at most 32 MB");
  toml::table file;
  try {
    file = toml::parse(toml);
  } catch (const toml::parse_error& error) {
    throw std::runtime_error(name + ':' + std::to_string(error.source().begin.line) +
                             ": not TOML: " + std::string(error.description()));
  }
  const Keys keys(name, file, "");
  keys.refuse_others_than({"seed", "up", "down", "both", "at", "clock"});
  Scenario scenario;
  scenario.seed = static_cast<std::uint64_t>(keys.whole("seed", INT64_MAX).value_or(1));
  Change begin = keys.profiles();
  if (begin.up) scenario.up = *std::move(begin.up);
  if (begin.down) scenario.down = *std::move(begin.down);
  keys.each("at", kMaxChanges, [&scenario](const Keys& table) {
    Scenario::Timed timed = timed_of(table);
    if (!scenario.changes.empty() && timed.at < scenario.changes.back().at) {
      table.fail(*table.find("t_s"), "t_s", "is earlier than the previous one, expected increasing times");
    }
    scenario.changes.push_back(std::move(timed));
  });
  if (const toml::node* const clock = keys.find("clock")) {
    if (!clock->is_table()) keys.fail(*clock, "clock", "expected a table [clock]");
    scenario.clock = clock_of(Keys(name, *clock->as_table(), "clock"));
  }
  return scenario;
}

Scenario read_scenario(const std::filesystem::path& path) {
  std::ifstream file = open_regular_file(path, "scenario");
  return parse_scenario(std::string(std::istreambuf_iterator<char>(file), {}), path.string());
}

Command parse_command(std::string_view line) {
  const auto [verb, rest] = split(line);
  if (is_way(verb)) return change_of(verb, rest);
  if (verb == "link") {
    const auto [number, what] = split(rest);
    const auto link = parse_whole(number);
    const auto [way, profile] = split(what);
    if (!link || *link > kMaxLink || !is_way(way)) {
      throw std::invalid_argument("link: expected the number of a client and a change, like: link 2 both wifi-bad");
    }
    Change change = change_of(way, profile);
    change.link = static_cast<std::uint32_t>(*link);
    change.text = "link " + std::to_string(*link) + ' ' + change.text;
    return change;
  }
  if (verb == "note") {
    if (rest.empty()) throw std::invalid_argument("note: expected a text");
    Change change;
    append(change.text, verb, rest);
    return change;
  }
  const bool alone = rest.empty();
  if (alone && verb == "stats") return Request::kStats;
  if (alone && verb == "help") return Request::kHelp;
  if (alone && verb == "stop") return Request::kStop;
  throw std::invalid_argument("unknown command " + in_quotes(verb) + ", expected " + command_help());
}

std::string command_help() {
  return "up PROFILE | down PROFILE | both PROFILE | link N up|down|both PROFILE | note TEXT | stats | help | stop; "
         "PROFILE is a line like \"delay=20ms loss=2%\" or a name: " +
         names_of_profiles();
}

ScenarioPlayer::ScenarioPlayer(Scenario scenario, LocalTime start)
    : changes_(std::move(scenario.changes)),
      start_(start),
      up_{{std::move(scenario.up), start}, {}},
      down_{{std::move(scenario.down), start}, {}} {}

std::optional<LocalTime> ScenarioPlayer::next_wake() const {
  if (next_ == changes_.size()) return std::nullopt;
  return start_ + changes_[next_].at;
}

std::optional<ScenarioPlayer::Due> ScenarioPlayer::next_due(LocalTime now) {
  const auto at = next_wake();
  if (!at || *at > now) return std::nullopt;
  Due due{*at, std::move(changes_[next_++].change)};
  change(due.change, due.at);
  return due;
}

void ScenarioPlayer::change(const Change& change, LocalTime now) {
  const auto put = [&](OneWay& way, const std::optional<Profile>& profile) {
    if (!profile) return;
    if (change.link) {
      way.of_one.insert_or_assign(*change.link, Weather{*profile, now});
    } else {
      way = {{*profile, now}, {}};
    }
  };
  put(up_, change.up);
  put(down_, change.down);
}

const ScenarioPlayer::Weather& ScenarioPlayer::weather(Direction direction, std::uint32_t link) const {
  const OneWay& way = direction == Direction::kUp ? up_ : down_;
  const auto own = way.of_one.find(link);
  return own == way.of_one.end() ? way.of_all : own->second;
}

}  // namespace tendon::injector
