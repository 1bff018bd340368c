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

// A bad network that changes: by a script (a TOML file) or by commands while it runs.
//
//   seed = 7
//   up = "wifi-good"                      # or a profile line: "delay=20ms loss=2%"; down = …, or both = … for both
//   ways down = "wifi-good loss=1%"
//
//   [[at]]                                # any number of these, in order of time
//   t_s = 5                               # since the start
//   both = "wifi-bad"                     # up, down or both; replaces what was there before
//   link = 2                              # optional: only this client's (counted from 0 as they come)
//   note = "microwave oven on"            # optional: goes into the trace
//
//   [clock]                               # of every peer; for simulated worlds only
//   offset_ms = 5
//   drift_ppm = 20
//   [[clock.step]]
//   t_s = 10
//   step_ms = 3
//
// Nothing is required; without up, down and both there is no delay and no loss. The times inside a profile
// (outage(at=5s,…)) count from when it came into force.

/// Another network from some time on.
struct Change {
  std::optional<std::uint32_t> link;  ///< only of this link; empty: of all
  std::optional<Profile> up, down;    ///< empty: stays as it is
  std::string text;                   ///< all of it as its author put it, in one line: "link 2 both wifi-bad"
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
  std::vector<Timed> changes;  ///< in order of time
  std::optional<DriftingClock::Config> clock;
  bool operator==(const Scenario&) const = default;
};

/// A day of a change each second.
inline constexpr std::size_t kMaxChanges = 86'400;

/// More clients than any driver serves.
inline constexpr std::uint32_t kMaxLink = 65'535;

/// Reads such a file. Throws std::runtime_error naming file, line and key for whatever is not as said above, unknown
/// keys among it: "storm.toml:9: at.both: loss is 150%, expected a probability from 0% to 100%".
Scenario read_scenario(const std::filesystem::path& path);
/// The same of its text; `name` is the file in errors.
Scenario parse_scenario(std::string_view toml, const std::string& name);

/// What one of the commands asks for, besides a Change.
enum class Request : std::uint8_t {
  kStats,  ///< say how it goes
  kHelp,   ///< say command_help()
  kStop,   ///< end the run
};
using Command = std::variant<Change, Request>;

/// One command as a line of text, for live control:
///
///     up PROFILE, down PROFILE, both PROFILE     from now on, for all clients and those who come
///     link N up|down|both PROFILE                for one client
///     note TEXT                                  into the trace
///     stats, help, stop
///
/// Throws std::invalid_argument saying what was expected.
Command parse_command(std::string_view line);

/// One line, for an answer: what there is to say.
std::string command_help();

/// What network there is, now and for whom: plays a scenario, and takes changes while it runs. Drivers ask it for the
/// profile of a link that is new, and give each change to the injectors that are there:
///
///     while (auto due = scenario.next_due(now))          // before any datagram of `now` is decided
///       for (each link and direction that due->change concerns)
///         injector.change(scenario.weather(direction, link).profile, due->at);
///
/// A change is in force for datagrams that arrive at its time or later, so what happens to them does not depend on when
/// and how often the driver asks, as long as it asks before it decides.
///
/// Thread-safe: no.
class ScenarioPlayer {
 public:
  ScenarioPlayer(Scenario scenario, LocalTime start);

  struct Due {
    LocalTime at{};
    Change change;
  };
  /// Takes out the next change of the script that is due at `now`; it is in force from here on. Empty when there is
  /// none.
  std::optional<Due> next_due(LocalTime now);

  /// When next_due will have something again; empty when the script is over.
  std::optional<LocalTime> next_wake() const;

  /// A change that is not in the script: from `now` on.
  void change(const Change& change, LocalTime now);

  struct Weather {
    Profile profile;
    LocalTime since{};  ///< from when its times count
  };
  /// The network of this link; the reference is valid until the next change.
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
