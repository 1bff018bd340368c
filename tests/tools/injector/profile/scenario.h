// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/traces/peer_clock.h"

namespace tendon::injector {

// A bad network that changes, by a script (a TOML file) or by commands at run time.
//
//   seed = 7
//   up = "wifi-good"
//   down = "wifi-good loss=1%"
//
//   [[at]]
//   t_s = 5
//   both = "wifi-bad"
//   note = "microwave oven on"
//
// Use `tendon-inject --scenario-help` to list all keys. The times inside a profile (outage(at=5s,…)) count from its
// activation.

struct Change {
  std::optional<std::uint32_t> link;  ///< if this is empty, all links
  std::optional<Profile> up, down;    ///< empty: unchanged
  std::string text;                   ///< the change in its author's words, on one line: "link 2 both wifi-bad"
  bool operator==(const Change&) const = default;
};

struct Scenario {
  std::uint64_t seed = 1;
  Profile up, down;
  struct Timed {
    Duration at{};  ///< since the start
    Change change;
    bool operator==(const Timed&) const = default;
  };
  std::vector<Timed> changes;  ///< sorted by time
  std::optional<DriftingClock::Config> clock;
  bool operator==(const Scenario&) const = default;
};

/// One change per second for a day.
inline constexpr std::size_t kMaxChanges = 86'400;

inline constexpr std::uint32_t kMaxLink = 65'535;

/// Throws std::runtime_error that names file, line and key for any error, including unknown keys: "storm.toml:9:
/// at[0].both: expected a profile, found "loss=150%": loss is 150%, expected a probability from 0% to 100%".
Scenario read_scenario(const std::filesystem::path& path);
/// Parses a text. `name` replaces the file name in errors.
Scenario parse_scenario(std::string_view toml, const std::string& name);

std::string scenario_reference();

enum class Request : std::uint8_t {
  kStats,
  kHelp,
  kStop,
};
using Command = std::variant<Change, Request>;

/// Parses a command for live control:
///
///     up PROFILE, down PROFILE, both PROFILE     for all present and future clients
///     link N up|down|both PROFILE                for one client
///     note TEXT                                  recorded in the trace
///     stats, help, stop
///
/// Throws std::invalid_argument with the expected format.
Command parse_command(std::string_view line);

std::string command_help();

/// Plays a scenario and accepts changes at run time. A driver passes each change to the existing injectors:
///
///     while (auto due = scenario.next_due(now))          // before any datagram of `now` is decided
///       for (each link and direction that due->change concerns)
///         injector.change(scenario.weather(direction, link).profile, due->at);
///
/// A change applies to datagrams that arrive at its time or later, whenever the driver polls before each decision.
///
/// Thread-safe: no.
class ScenarioPlayer {
 public:
  ScenarioPlayer(Scenario scenario, LocalTime start);

  struct Due {
    LocalTime at{};
    Change change;
  };
  std::optional<Due> next_due(LocalTime now);

  std::optional<LocalTime> next_wake() const;

  void change(const Change& change, LocalTime now);

  struct Weather {
    Profile profile;
    LocalTime since{};  ///< origin of its times
  };
  /// Valid until the next change.
  const Weather& weather(Direction direction, std::uint32_t link) const;

 private:
  std::vector<Scenario::Timed> changes_;
  LocalTime start_;
  std::size_t next_ = 0;
  struct OneWay {
    Weather of_all;
    std::map<std::uint32_t, Weather> of_one;
  };
  OneWay up_, down_;
};

}  // namespace tendon::injector
