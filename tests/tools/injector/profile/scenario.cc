// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/scenario.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "server/machine/regular_file.h"
#include "server/scene/reader.h"
#include "server/scene/reference.h"
#include "server/scene/values.h"
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

struct ChangeText {
  std::string_view key;

  std::string expected(const scene_file::Unit&) const {
    return key == "note" ? "a text in quotes" : "a profile in quotes like \"delay=20ms loss=2%\" or \"wifi-bad\"";
  }

  scene_file::Verdict take(const toml::node& node, const scene_file::Unit& unit, Change& to) const {
    const auto* text = node.as_string();
    if (text == nullptr) return scene_file::Refusal{&node, expected(unit)};
    if (key != "note") {
      if (to.text.starts_with("both ")) return scene_file::Refusal{&node, "either both, or up and down"};
      try {
        set_profiles(to, key, **text);
      } catch (const std::invalid_argument& refused) {
        return scene_file::Refusal{&node, "a profile", std::string(": ") + refused.what()};
      }
    }
    append(to.text, key, **text);
    return {};
  }

  static std::string shown(const scene_file::Unit&, const Change&) { return "none"; }
};

template <class Table>
void declare_profiles(Table& keys, Change& change, const scene_file::Absent& absent) {
  keys.key("both", change, ChangeText{"both"}, "Profile of both directions", absent);
  keys.key("up", change, ChangeText{"up"}, "Profile from client to server", absent);
  keys.key("down", change, ChangeText{"down"}, "Profile from server to client", absent);
}

template <class Table>
void declare_scenario(Table& scenario, Scenario& to, Change& begin) {
  using scene_file::kRequired;
  using scene_file::Number;
  constexpr double kDay = 86'400;  // s, as for all times
  constexpr Number kTime{.least = 0, .most = kDay};
  constexpr Number kShift{.least = -kDay * 1e3, .most = kDay * 1e3};
  scenario.key("seed", to.seed, scene_file::Count{INT64_MAX}, "Seed of the random numbers, unless --seed is used");
  declare_profiles(scenario, begin, {.text = "no delay and no loss"});
  scenario.tables("at", to.changes, kMaxChanges, [&](Table& at, Scenario::Timed& timed) {
    at.key("t_s", timed.at, kTime, "Time since the start. Must not decrease", kRequired);
    declare_profiles(at, timed.change, {.text = "no change"});
    at.key("link", timed.change.link, scene_file::Count{kMaxLink}, "Changes only this client, numbered by arrival",
           {.text = "all clients"});
    at.key("note", timed.change, ChangeText{"note"}, "Text that is recorded in the trace");
  });
  scenario.part("clock", to.clock, [&](Table& clock, DriftingClock::Config& config) {
    double drift = 0;
    clock.key("offset_ms", config.offset, kShift, "Offset of the clock of each peer. For simulations only");
    clock.key("drift_ppm", drift, Number{.least = -1e5, .most = 1e5}, "Drift of this clock. Above zero: fast");
    config.drift_ppb = std::llround(drift * 1e9);
    clock.tables("step", config.steps, DriftingClock::kMaxSteps, [&](Table& step, DriftingClock::Step& change) {
      step.key("t_s", change.at, kTime, "Time since the start. Must increase", kRequired);
      step.key("step_ms", change.change, kShift, "Change of the clock", kRequired);
    });
  });
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
  const toml::table file = scene_file::parse_toml(toml, name);
  Scenario scenario;
  Change begin;
  scene_file::SceneProblems problems;
  scene_file::Reader reader(problems, &file, "", {});
  declare_scenario(reader, scenario, begin);
  reader.refuse_unknown();
  problems.throw_first(name);
  scenario.up = std::move(begin.up).value_or(Profile{});
  scenario.down = std::move(begin.down).value_or(Profile{});
  const scene_file::SceneErrors errors(file, name);
  if (scenario.clock) errors.build("clock", [&] { DriftingClock{*scenario.clock}; });
  for (std::size_t i = 0; i < scenario.changes.size(); ++i) {
    auto& [at, change] = scenario.changes[i];
    const std::string path = "at[" + std::to_string(i) + ']';
    if (i > 0 && at < scenario.changes[i - 1].at) {
      errors.blame(path + ".t_s", {}, "is earlier than the previous one, expected increasing times");
    }
    if (change.link && !change.up && !change.down) {
      errors.blame(path + ".link", {}, "expected up, down or both with it");
    }
    if (change.text.empty()) errors.blame(path, {}, "expected up, down, both or note");
    if (change.link) change.text = "link " + std::to_string(*change.link) + ' ' + change.text;
  }
  return scenario;
}

std::string scenario_reference() {
  std::string text;
  Scenario scenario;
  Change begin;
  scene_file::Reference reference(text);
  declare_scenario(reference, scenario, begin);
  return text;
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
