// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/playground/playground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "core/control/catalogue.h"
#include "server/scene/scene.h"
#include "server/scene/scene_error.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::playground::playground_test {
namespace {

constexpr double kTouch = 0.012;  // m, depth in the wall

const nlohmann::json& described() {
  static const nlohmann::json kJson = nlohmann::json::parse(description());
  return kJson;
}

std::size_t law(const std::string& name) {
  const auto& all = described()["laws"];
  std::size_t i = 0;
  while (all.at(i)["name"] != name) ++i;
  return i;
}

struct Row {
  double t, wish_x, wish_y, x, y, force_x, force_y, true_force, energy, limited;
};

std::vector<Row> rows_of(std::span<const double> numbers) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < numbers.size(); i += 10) {
    const double* n = &numbers[i];
    rows.push_back({n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9]});
  }
  return rows;
}

struct Leg {
  int count;  ///< periods
  double x;   ///< m, where the wish arrives
};
/// A press of one second.
constexpr Leg kTouching[] = {{500, kTouch}, {1000, kTouch}, {500, -kTouch}};

std::vector<Row> touched(const Settings& settings) {
  Playground playground(settings, -kTouch, 0);
  std::vector<Row> all;
  for (const Leg& leg : kTouching) {
    const auto more = rows_of(playground.step(leg.count, leg.x, 0));
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

Settings calm() {
  Settings settings = usual_settings();
  settings.delay_ms = settings.jitter_ms = settings.loss_percent = 0;
  settings.stiffness = 200;
  return settings;
}

double least_energy(const std::vector<Row>& rows) { return std::ranges::min(rows, {}, &Row::energy).energy; }

/// Fraction of the periods with a new force, while the hand moves by at least a count of the encoder in each.
double share_of_new_forces(Settings settings) {
  double periods = 0;
  double changed = 0;
  for (settings.seed = 1; settings.seed <= 10; settings.seed += 1) {
    Playground playground(settings, -kTouch, 0);
    const std::vector<Row> rows = rows_of(playground.step(200, kTouch, 0));
    for (std::size_t i = 120; i < 155; ++i) {
      periods += 1;
      if (rows[i].force_x != rows[i - 1].force_x) changed += 1;
    }
  }
  return changed / periods;
}

/// The text between `from` and `to` in the command.
std::string part(const std::string& command, const std::string& from, const std::string& to) {
  const std::size_t begin = command.find(from) + from.size();
  return command.substr(begin, command.find(to, begin) - begin);
}

/// Returns the energy that the lab computes with the options of the command.
double energy_of(const std::string& command) {
  ScriptedMotion::Point wish{.position = {-kTouch, 0, 0}};
  lab::Experiment experiment = experiment_of(calm(), wish);
  const double stiffness = std::stod(part(command, "--stiffness ", " "));
  experiment.environment.force = [stiffness](double, const Vec3& at) {
    return Vec3(-stiffness * std::max(0.0, at.x()), 0, 0);
  };
  const injector::Profile network = injector::parse_profile(part(command, "--network '", "'"));
  experiment.environment.route->there = experiment.environment.route->back = network;
  experiment.seed = std::stoull(command.substr(command.find("--first-seed ") + 13));
  experiment.limiter.environment_stiffness = stiffness;
  experiment.limiter.law = law_named(part(command, "--law ", " ")).value();
  lab::LiveRun run(experiment);
  double energy = 0;
  for (const Leg& leg : kTouching) {
    for (int left = leg.count; left > 0; --left) {
      const Vec3 way = (Vec3(leg.x, 0, 0) - wish.position) / left;
      wish = {wish.position + way, way / 1e-3};
      energy = run.step().energy;
    }
  }
  return energy;
}

TEST(Playground, TheLabGetsTheSameEnergyFromTheWordsOfTheCommand) {
  for (const char* name : {"none", "aol", "energy-bounding"}) {
    Settings settings = usual_settings();
    settings.delay_ms = 7;
    settings.loss_percent = 10;
    settings.stiffness = 700;
    settings.seed = 42;
    settings.law = law(name);
    const std::string line = command(settings);
    EXPECT_EQ(part(line, "--law ", " "), name);
    EXPECT_NE(line.find("--stiffness 700 "), std::string::npos);
    EXPECT_NE(line.find("delay=uniform(2ms,12ms) memory=20ms loss=10%"), std::string::npos) << line;
    EXPECT_EQ(energy_of(line), touched(settings).back().energy) << line;
  }
}

TEST(Playground, TheForceComesAfterTheDelaysOfBothDirections) {
  for (const double delay : {0.0, 20.0, 80.0}) {
    Settings settings = calm();
    settings.delay_ms = delay;
    const std::vector<Row> rows = touched(settings);
    const auto contact = std::ranges::find_if(rows, [](const Row& row) { return row.x > 1e-4; });
    const auto force = std::ranges::find_if(rows, [](const Row& row) { return row.force_x != 0; });
    EXPECT_NEAR(force->t - contact->t, 2e-3 * delay + 1e-3, 3e-3) << delay;
  }
}

TEST(Playground, ALossInBothDirectionsLeavesTheProductOfTheRest) {
  Settings settings = calm();
  EXPECT_GT(share_of_new_forces(settings), 0.95);
  settings.loss_percent = 50;
  EXPECT_NEAR(share_of_new_forces(settings), 0.25, 0.1);
}

TEST(Playground, AHandAtRestFeelsTheStiffnessOfTheWall) {
  for (const double stiffness : {200.0, 400.0}) {
    Settings settings = calm();
    settings.stiffness = stiffness;
    const Row pressed = touched(settings)[1400];
    EXPECT_NEAR(-pressed.force_x / pressed.x, stiffness, 0.02 * stiffness);
    EXPECT_NEAR(pressed.true_force, -stiffness * pressed.x, 1e-12);
  }
}

TEST(Playground, OnlyTheLawsThatLimitKeepADelayedWallFromGivingOutEnergy) {
  Settings settings = usual_settings();
  EXPECT_LT(least_energy(touched(settings)), -0.1);
  for (const char* name : {"feel", "feel-unconditional", "aol", "energy-bounding"}) {
    settings.law = law(name);
    EXPECT_GE(least_energy(touched(settings)), -1e-9) << name;
  }
}

TEST(Playground, EachSeedIsAnotherNetworkAndEachRunOfASeedTheSame) {
  Settings settings = usual_settings();
  const auto energy = [&settings](double seed) {
    settings.seed = seed;
    return touched(settings).back().energy;
  };
  EXPECT_EQ(energy(1), energy(1));
  EXPECT_NE(energy(1), energy(2));
}

TEST(Playground, EveryLawRunsAtBothEndsOfEverySlider) {
  for (std::size_t i = 0; i < described()["laws"].size(); ++i) {
    for (const char* end : {"least", "most"}) {
      const auto& s = described()["sliders"];
      const Settings settings{s[0][end], s[1][end], s[2][end], s[3][end], s[4][end], i};
      for (const Row& row : touched(settings)) ASSERT_TRUE(std::isfinite(row.energy) && std::abs(row.force_x) <= 8);
      EXPECT_NO_THROW(injector::parse_profile(part(command(settings), "--network '", "'")));
    }
  }
}

TEST(Playground, TheDeviceTheHandAndTheLimiterAreThoseOfTheDemo) {
  const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / "demo.toml");
  const SimulatedDevice::Config& theirs = scene.simulated();
  Settings settings = usual_settings();
  settings.law = law("feel");
  const ScriptedMotion::Point wish;
  const lab::Experiment experiment = experiment_of(settings, wish);
  const auto& ours = std::get<lab::FreeHand>(experiment.hand);
  EXPECT_EQ(ours.mass, theirs.mass);
  EXPECT_EQ(ours.viscous_friction, theirs.viscous_friction);
  EXPECT_EQ(ours.coulomb_friction, theirs.coulomb_friction);
  EXPECT_EQ(ours.encoder_step, theirs.encoder_step);
  EXPECT_EQ(ours.amplifier_bandwidth, theirs.amplifier_bandwidth);
  EXPECT_EQ(ours.watchdog, theirs.watchdog);
  EXPECT_EQ(ours.hand->stiffness, theirs.hand->stiffness);
  EXPECT_EQ(ours.hand->damping, theirs.hand->damping);
  EXPECT_EQ(ours.hand->mass, theirs.hand->mass);
  const HapticController::Config& control = scene.loop.control;
  EXPECT_EQ(experiment.limiter.law, control.limiter.law);
  EXPECT_EQ(experiment.limiter.friction.coulomb, control.limiter.friction.coulomb);
  EXPECT_EQ(experiment.limiter.friction.viscous, control.limiter.friction.viscous);
  EXPECT_EQ(experiment.max_force, control.max_force);
}

/// Returns true if tendon-lab sweep can use this law (see GridBench::scene_of).
bool fits_the_demo(const std::string& name, const Scene& demo) {
  const bool preset = name.starts_with("feel");
  std::vector<std::string> settings = limiter_settings(preset ? "aol+" : name, demo.loop.control);
  if (preset) settings.push_back("limiter.preset=\"" + name + '"');
  try {
    parse_scene(demo.text, "demo.toml", TENDON_SCENES, settings);
    return true;
  } catch (const SceneError&) {
    return false;
  }
}

TEST(Playground, TheLawsAreThoseThatTheSceneOfTheDemoCanUse) {
  const Scene demo = read_scene(std::filesystem::path(TENDON_SCENES) / "demo.toml");
  std::vector<std::string> expected = {"feel", "feel-unconditional"};
  for (const LawInfo& each : laws()) {
    if (fits_the_demo(std::string(each.name), demo)) expected.emplace_back(each.name);
  }
  std::vector<std::string> offered;
  for (const auto& each : described()["laws"]) offered.push_back(each["name"]);
  EXPECT_EQ(offered, expected);
  EXPECT_TRUE(fits_the_demo("feel", demo) && fits_the_demo("feel-unconditional", demo));
}

TEST(Playground, NamesTheSettingThatIsOutOfBounds) {
  const auto refused = [](double Settings::*value, double to) -> std::string {
    Settings settings = usual_settings();
    settings.*value = to;
    try {
      Playground(settings, 0, 0);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refused(&Settings::delay_ms, 151), "delay = 151: expected 0 to 150");
  EXPECT_EQ(refused(&Settings::stiffness, std::nan("")), "stiffness = nan: expected 100 to 4000");
  EXPECT_EQ(refused(&Settings::seed, 1.5), "seed = 1.5: expected an integer");
  EXPECT_THROW(Playground(usual_settings(), 0, 0).step(1, 0.041, 0), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::playground::playground_test
