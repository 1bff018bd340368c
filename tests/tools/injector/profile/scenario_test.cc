// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/scenario.h"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::injector::scenario_test {
namespace {

using namespace std::chrono_literals;

LocalTime at(Duration since_zero) { return LocalTime(since_zero); }

std::string refusal(const std::string& toml) {
  return thrown_by<std::runtime_error>([&] { parse_scenario(toml, "storm.toml"); });
}

std::string refusal_of_command(const std::string& line) {
  return thrown_by([&] { parse_command(line); });
}

constexpr const char* kStorm = R"toml(
seed = 7
up = "delay=5ms"
down = "wifi-good loss=1%"

[[at]]
t_s = 0.5004
both = "delay=20ms loss=10%"
note = "microwave oven on"

[[at]]
t_s = 1.0004
link = 1
up = "outage(at=100ms,for=200ms)"

[[at]]
t_s = 2
note = "nothing happens"

[[at]]
t_s = 2.5
both = "lan"

[clock]
offset_ms = 5
drift_ppm = -20.5

[[clock.step]]
t_s = 10
step_ms = -3
)toml";

TEST(Scenario, SaysWhatTheFileSays) {
  const Scenario scenario = parse_scenario(kStorm, "storm.toml");
  EXPECT_EQ(scenario.seed, 7U);
  EXPECT_EQ(scenario.up, parse_profile("delay=5ms"));
  EXPECT_EQ(scenario.down, resolve_profile("wifi-good loss=1%", Direction::kDown));
  ASSERT_EQ(scenario.changes.size(), 4U);
  EXPECT_EQ(scenario.changes[0].at, 500'400us);
  EXPECT_EQ(scenario.changes[0].change.up, parse_profile("delay=20ms loss=10%"));
  EXPECT_EQ(scenario.changes[0].change.down, scenario.changes[0].change.up);
  EXPECT_EQ(scenario.changes[0].change.text, "both delay=20ms loss=10%, note microwave oven on");
  EXPECT_EQ(scenario.changes[1].change.link, 1U);
  EXPECT_EQ(scenario.changes[1].change.down, std::nullopt);
  EXPECT_EQ(scenario.changes[1].change.text, "link 1 up outage(at=100ms,for=200ms)");
  EXPECT_EQ(scenario.changes[2].change.up, std::nullopt);
  EXPECT_EQ(scenario.changes[3].change.up, resolve_profile("lan", Direction::kUp));
  EXPECT_EQ(scenario.changes[3].change.down, resolve_profile("lan", Direction::kDown));
  EXPECT_EQ(scenario.clock, (DriftingClock::Config{5ms, -20'500, {{10s, -3ms}}}));
}

TEST(Scenario, AnEmptyFileIsAPerfectNetwork) {
  const Scenario scenario = parse_scenario("", "empty.toml");
  EXPECT_EQ(scenario.up, Profile{});
  EXPECT_TRUE(scenario.changes.empty());
  EXPECT_FALSE(scenario.clock);
}

TEST(Scenario, WhatIsWrongIsNamedWithFileLineAndKey) {
  const std::string step = "[[clock.step]]\nt_s = 1\nstep_ms = 1\n";
  for (const auto& [toml, complaint] : std::vector<std::pair<std::string, std::string>>{
           {"sed = 7", "1: sed: unknown key; did you mean seed?"},
           {"seed = -1", "1: seed: expected a whole number from 0 to 9223372036854775807, found -1"},
           {"\nboth = 20",
            "2: both: expected a profile in quotes like \"delay=20ms loss=2%\" or \"wifi-bad\", found 20"},
           {"both = \"lan\"\nup = \"lan\"", "2: up: expected either both, or up and down, found \"lan\""},
           {"[[at]]\nt_s = 1\nboth = \"loss=150%\"",
            "3: at[0].both: expected a profile, found \"loss=150%\": loss is 150%, expected a probability from 0% to "
            "100%"},
           {"[[at]]\nboth = \"lan\"", "1: at[0].t_s: missing, expected a number from 0 to 86400 s"},
           {"[[at]]\nt_s = 1", "1: at[0]: expected up, down, both or note"},
           {"[[at]]\nt_s = -1", "2: at[0].t_s: expected a number from 0 to 86400 s, found -1"},
           {"[[at]]\nt_s = nan", "2: at[0].t_s: expected a number from 0 to 86400 s, found nan"},
           {"[[at]]\nt_s = 2\nnote = \"a\"\n[[at]]\nt_s = 1\nnote = \"b\"",
            "5: at[1].t_s: is earlier than the previous one, expected increasing times"},
           {"[[at]]\nt_s = 1\nlink = 2", "3: at[0].link: expected up, down or both with it"},
           {"[at]\nt_s = 1", "1: at: expected 1 to 86400 tables [[at]], found a table"},
           {"[[at]]\nt_s = 1\nbooth = \"lan\"", "3: at[0].booth: unknown key; did you mean both?"},
           {"[clock]\nsteps = 1", "2: clock.steps: unknown key; did you mean step?"},
           {"[clock]\ndrift_ppm = 1e6",
            "2: clock.drift_ppm: expected a number from -100000 to 100000 ppm, found 1000000"},
           {"[[clock.step]]\nt_s = 1",
            "1: clock.step[0].step_ms: missing, expected a number from -86400000 to 86400000 ms"},
           {step + step, "1: clock: the times of a clock's steps must increase, and not exceed 10 years"}}) {
    EXPECT_EQ(refusal(toml), "storm.toml:" + complaint);
  }
  EXPECT_EQ(refusal("seed = 7\n= 8").substr(0, 22), "storm.toml:2: not TOML");
}

TEST(Scenario, TheReferenceNamesEveryKeyThatTheFileMayHave) {
  const std::string reference = scenario_reference();
  std::istringstream storm(kStorm);
  for (std::string line; std::getline(storm, line);) {
    if (line.empty()) continue;
    const std::string key = line.starts_with('[') ? line : "  " + line.substr(0, line.find(' ')) + "\n";
    EXPECT_NE(reference.find(key), std::string::npos) << key << "in\n" << reference;
  }
}

TEST(Scenario, InVirtualTimeTheSameSeedMeetsTheSameFates) {
  const auto run = [](Duration poll) {
    const Scenario scenario = parse_scenario(kStorm, "storm.toml");
    ScenarioPlayer player(scenario, at(100s));
    std::map<std::pair<Direction, std::uint32_t>, Injector> injectors;
    std::vector<Decision> decisions;
    const auto look = [&](LocalTime now) {
      while (const auto due = player.next_due(now)) {
        for (auto& [flow, injector] : injectors) {
          const auto& [profile, since] = player.weather(flow.first, flow.second);
          if (since == due->at) injector.change(profile, since);
        }
      }
    };
    LocalTime looked = at(100s);
    for (int i = 0; i < 3000; ++i) {
      const LocalTime now = at(100s + 1ms * i);
      for (; poll > Duration::zero() && looked < now; looked += poll) look(looked);
      look(now);
      for (const Direction direction : {Direction::kUp, Direction::kDown}) {
        // The second client joins in the middle of a regime of the scenario.
        for (std::uint32_t link = 0; link < (i < 700 ? 1U : 2U); ++link) {
          auto injector = injectors.find({direction, link});
          if (injector == injectors.end()) {
            const auto& [profile, since] = player.weather(direction, link);
            injector =
                injectors.emplace(std::pair(direction, link), Injector(profile, scenario.seed, link, direction, since))
                    .first;
          }
          decisions.push_back(injector->second.decide({.arrival = now, .size = 100, .bytes = {}}));
        }
      }
    }
    return decisions;
  };
  const auto decisions = run(0ms);
  EXPECT_EQ(run(333us), decisions);
  EXPECT_EQ(run(17ms), decisions);
  EXPECT_EQ(run(0ms), decisions);
  // The outage affects link 1 only, from 1.1004 s to 1.3004 s.
  std::map<Duration, int> outage;
  for (const Decision& decision : decisions) {
    if (decision.cause == Cause::kOutage) ++outage[decision.arrival - at(100s)];
  }
  ASSERT_EQ(outage.size(), 200U);
  EXPECT_EQ(outage.begin()->first, 1101ms);
  EXPECT_EQ(outage.begin()->second, 1);
  EXPECT_EQ(outage.rbegin()->first, 1300ms);
}

TEST(ScenarioPlayer, AChangeIsInForceFromItsTimeOnWheneverItIsAskedFor) {
  ScenarioPlayer player(parse_scenario(kStorm, "storm.toml"), at(100s));
  EXPECT_EQ(player.next_wake(), at(100s + 500'400us));
  EXPECT_FALSE(player.next_due(at(100s + 500'399us)));
  EXPECT_EQ(player.weather(Direction::kUp, 0).since, at(100s));
  EXPECT_TRUE(player.next_due(at(100s + 500'400us)));
  EXPECT_EQ(player.weather(Direction::kUp, 0).since, at(100s + 500'400us));
  const auto late = player.next_due(at(200s));
  ASSERT_TRUE(late);
  EXPECT_EQ(late->at, at(101s + 400us));
  EXPECT_EQ(player.weather(Direction::kUp, 1).since, at(101s + 400us));
  EXPECT_TRUE(player.next_due(at(200s)));
  EXPECT_TRUE(player.next_due(at(200s)));
  EXPECT_FALSE(player.next_due(at(200s)));
  EXPECT_FALSE(player.next_wake());
}

TEST(ScenarioPlayer, AChangeForOneLinkHoldsUntilOneForAll) {
  ScenarioPlayer player(parse_scenario("both = \"delay=1ms\"", "x"), at(0s));
  const auto delay = [&player](Direction direction, std::uint32_t link) {
    return player.weather(direction, link).profile;
  };
  player.change(std::get<Change>(parse_command("link 2 up delay=9ms")), at(3s));
  EXPECT_EQ(delay(Direction::kUp, 2), parse_profile("delay=9ms"));
  EXPECT_EQ(player.weather(Direction::kUp, 2).since, at(3s));
  EXPECT_EQ(delay(Direction::kDown, 2), parse_profile("delay=1ms"));
  EXPECT_EQ(delay(Direction::kUp, 3), parse_profile("delay=1ms"));
  player.change(std::get<Change>(parse_command("down delay=4ms")), at(4s));
  EXPECT_EQ(delay(Direction::kUp, 2), parse_profile("delay=9ms"));
  EXPECT_EQ(delay(Direction::kDown, 2), parse_profile("delay=4ms"));
  player.change(std::get<Change>(parse_command("both delay=5ms")), at(5s));
  EXPECT_EQ(delay(Direction::kUp, 2), parse_profile("delay=5ms"));
}

TEST(Command, IsOneLineOfText) {
  const auto change = std::get<Change>(parse_command("  both  wifi-bad loss=5% \n"));
  EXPECT_EQ(change.up, resolve_profile("wifi-bad loss=5%", Direction::kUp));
  EXPECT_EQ(change.down, resolve_profile("wifi-bad loss=5%", Direction::kDown));
  EXPECT_EQ(change.link, std::nullopt);
  EXPECT_EQ(change.text, "both wifi-bad loss=5%");
  EXPECT_EQ(std::get<Change>(parse_command("up lan")).down, std::nullopt);
  EXPECT_EQ(std::get<Change>(parse_command("link 2 down lan")).text, "link 2 down lan");
  EXPECT_EQ(std::get<Change>(parse_command("note oven on")).text, "note oven on");
  EXPECT_EQ(parse_command("stats"), Command(Request::kStats));
  EXPECT_EQ(parse_command("help\r\n"), Command(Request::kHelp));
  EXPECT_EQ(parse_command("stop"), Command(Request::kStop));
}

TEST(Command, IsHowAScenariosChangeIsWrittenIntoTheTrace) {
  const Scenario scenario = parse_scenario("[[at]]\nt_s = 1\nlink = 2\nboth = \"delay=3ms\"", "x");
  EXPECT_EQ(parse_command(scenario.changes[0].change.text), Command(scenario.changes[0].change));
}

TEST(Command, AWrongOneSaysWhatWasExpected) {
  EXPECT_EQ(refusal_of_command("faster"), "unknown command \"faster\", expected " + command_help());
  EXPECT_EQ(refusal_of_command(""), "unknown command \"\", expected " + command_help());
  EXPECT_EQ(refusal_of_command("stop now"), "unknown command \"stop\", expected " + command_help());
  EXPECT_EQ(refusal_of_command("up").substr(0, 30), "\"up\" without a profile, expect");
  EXPECT_EQ(refusal_of_command("link two both lan"),
            "link: expected the number of a client and a change, like: link 2 both wifi-bad");
  EXPECT_EQ(refusal_of_command("note"), "note: expected a text");
  EXPECT_NE(refusal_of_command("both delay=20").find("20ms"), std::string::npos);
}

TEST(Command, NoBytesWhateverDoMoreThanAnError) {
  std::mt19937_64 random(1);
  constexpr std::string_view kLikely = " \n\t0129=%(),-#[]\"\'abelinkupdownbothdelay\r\0\xff";
  const std::string storm = kStorm;
  for (int run = 0; run < 3000; ++run) {
    std::string line = std::vector<std::string>{"link 2 both delay=20ms", "up wifi-bad", storm}[random() % 3];
    for (std::uint64_t changes = 1 + random() % 3; changes > 0; --changes) {
      line[random() % line.size()] = kLikely[random() % kLikely.size()];
    }
    try {
      parse_command(line);
    } catch (const std::invalid_argument&) {
    }
    try {
      parse_scenario(line, "x");
    } catch (const std::runtime_error&) {
    }
  }
}

}  // namespace
}  // namespace tendon::injector::scenario_test
