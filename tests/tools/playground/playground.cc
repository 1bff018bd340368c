// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/playground/playground.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <string_view>

#include "core/base/expect.h"
#include "core/control/catalogue.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"

namespace tendon::playground {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);
constexpr double kReach = 0.04;  // m, to each side: the workspace of a Falcon is a ball of about this radius
constexpr double kRateHz = 1000;

/// Correlation time of the delays. If the delays were independent, first-in-first-out order would increase most of them
/// to the maximum.
constexpr Duration kMemory = std::chrono::milliseconds(20);

struct Slider {
  std::string_view key;
  std::string_view label;
  std::string_view unit;
  double least;
  double most;
  double step;
  double usual;  ///< the network and the wall of deploy/demo
  double Settings::*value;
};

constexpr std::array kSliders = {
    Slider{"delay", "Delay each way", "ms", 0, 150, 1, 20, &Settings::delay_ms},
    Slider{"jitter", "Jitter ±", "ms", 0, 50, 1, 5, &Settings::jitter_ms},
    Slider{"loss", "Loss", "%", 0, 50, 1, 2, &Settings::loss_percent},
    Slider{"stiffness", "Wall stiffness", "N/m", 100, 4000, 50, 2000, &Settings::stiffness},
    Slider{"seed", "Seed of the network", "", 1, 100, 1, 7, &Settings::seed},
};

/// There is no limiter at first, to show why it is needed.
constexpr std::string_view kUsualLaw = "none";

constexpr std::array<std::string_view, 10> kColumns = {"t_s",       "wish_x_m",  "wish_y_m",     "x_m",      "y_m",
                                                       "force_x_n", "force_y_n", "true_force_n", "energy_j", "limited"};

struct Choice {
  std::string_view name;
  std::string_view what;
  Law law;
  std::optional<Preset> preset;
};

/// The sweep refuses these laws for the demo: they need more keys in the scene, or the friction of each axis.
bool lacks_settings(const LawInfo& law) {
  return law.needs_stiffness || law.law == Law::kClamp || law.law == Law::kAolPerAxis || law.law == Law::kAolBox;
}

std::vector<Choice> choices() {
  std::vector<Choice> all;
  for (const PresetInfo& preset : presets()) all.push_back({preset.name, preset.what, Law::kAolPlus, preset.preset});
  for (const LawInfo& law : laws()) {
    if (!lacks_settings(law)) all.push_back({law.name, law.what, law.law, std::nullopt});
  }
  return all;
}

void check(const Settings& settings) {
  for (const Slider& slider : kSliders) {
    const double value = settings.*slider.value;
    expect(value >= slider.least && value <= slider.most, slider.key, value,
           shortest(slider.least) + " to " + shortest(slider.most));
  }
  expect(settings.seed == std::floor(settings.seed), "seed", settings.seed, "an integer");
  const std::size_t known = choices().size();
  expect(settings.law < known, "law", static_cast<double>(settings.law),
         "below " + shortest(static_cast<double>(known)));
}

Duration milliseconds(double count) { return from_seconds(count / 1000); }

injector::Profile network(const Settings& settings) {
  injector::Profile profile;
  if (settings.jitter_ms > 0) {
    profile.delay = injector::UniformDelay{milliseconds(std::max(0.0, settings.delay_ms - settings.jitter_ms)),
                                           milliseconds(settings.delay_ms + settings.jitter_ms)};
    profile.memory = kMemory;
  } else {
    profile.delay = injector::ConstantDelay{milliseconds(settings.delay_ms)};
  }
  profile.loss = injector::RandomLoss{settings.loss_percent / 100};
  return profile;
}

std::string quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

std::string named(std::string_view name, std::string_view text) { return quoted(name) + ':' + quoted(text); }

std::string named(std::string_view name, double value) { return quoted(name) + ':' + shortest(value); }

template <class Items, class Text>
std::string list(std::string_view name, const Items& items, Text text) {
  std::string all;
  for (const auto& item : items) all += (all.empty() ? "" : ",") + text(item);
  return quoted(name) + ":[" + all + ']';
}

}  // namespace

Settings usual_settings() {
  Settings settings;
  for (const Slider& slider : kSliders) settings.*slider.value = slider.usual;
  const std::vector<Choice> all = choices();
  while (all.at(settings.law).name != kUsualLaw) ++settings.law;
  return settings;
}

std::string description() {
  const auto slider = [](const Slider& s) {
    return '{' + named("key", s.key) + ',' + named("label", s.label) + ',' + named("unit", s.unit) + ',' +
           named("least", s.least) + ',' + named("most", s.most) + ',' + named("step", s.step) + ',' +
           named("usual", s.usual) + '}';
  };
  const auto law = [](const Choice& c) { return '{' + named("name", c.name) + ',' + named("what", c.what) + '}'; };
  return '{' + named("period_s", seconds(kPeriod)) + ',' + named("reach_m", kReach) + ',' +
         list("columns", kColumns, quoted) + ',' + list("sliders", kSliders, slider) + ',' +
         list("laws", choices(), law) + ',' + named("usual_law", kUsualLaw) + '}';
}

std::string command(const Settings& settings) {
  check(settings);
  return "build/release/bin/tendon-lab sweep deploy/scenes/demo.toml --network '" + to_string(network(settings)) +
         "' --stiffness " + shortest(settings.stiffness) + " --law " + std::string(choices()[settings.law].name) +
         " --rate-hz " + shortest(kRateHz) + " --first-seed " + shortest(settings.seed);
}

lab::Experiment experiment_of(const Settings& settings, const ScriptedMotion::Point& wish) {
  check(settings);
  const DeviceProfile& falcon = *find_device_profile("falcon");
  SimulatedDevice::Config device = falcon.device();
  device.watchdog = std::chrono::milliseconds(5);
  device.hand = OperatorHand::Config{
      .stiffness = 300, .damping = 3, .mass = 0.05, .motion = ScriptedMotion(ScriptedMotion::Guided{&wish})};

  lab::Experiment experiment;
  experiment.environment.force = [stiffness = settings.stiffness](double /*t*/, const Vec3& hand) {
    return Vec3(-stiffness * std::max(0.0, hand.x()), 0, 0);
  };
  // This is less than a period, so every motion that arrives is answered.
  experiment.environment.route =
      lab::Route{.there = network(settings), .back = network(settings), .compute = std::chrono::microseconds(200)};
  experiment.hand = device;
  experiment.period = kPeriod;
  experiment.max_force = falcon.max_force.value;
  experiment.seed = static_cast<std::uint64_t>(settings.seed);
  experiment.limiter.friction = falcon.friction_bounds();
  experiment.limiter.environment_stiffness = settings.stiffness;
  const Choice choice = choices()[settings.law];
  experiment.limiter.law = choice.law;
  if (choice.preset) {
    const PresetParts chosen = preset_parts(
        *choice.preset,
        {.friction = experiment.limiter.friction, .longest_hold = kPeriod, .encoder_step = falcon.encoder_step.value});
    experiment.limiter.parts = chosen.parts;
    experiment.learned_model = chosen.learned_model;
  }
  return experiment;
}

Playground::Playground(const Settings& settings, double x, double y)
    : wish_{.position = {x, y, 0}, .velocity = Vec3::Zero()}, run_(experiment_of(settings, wish_)) {}

std::span<const double> Playground::step(int count, double x, double y) {
  for (const double value : {x, y}) {
    expect(std::abs(value) <= kReach, "position", value, "at most " + shortest(kReach) + " m from the middle");
  }
  rows_.clear();
  const Vec3 target(x, y, 0);
  for (int left = count; left > 0; --left) {
    const Vec3 way = (target - wish_.position) / left;
    wish_.position += way;
    wish_.velocity = way / seconds(kPeriod);
    const lab::Moment m = run_.step();
    const bool limited = m.step.reasons.has(Reason::kEnergy);
    const std::array<double, kColumns.size()> row = {m.t,
                                                     wish_.position.x(),
                                                     wish_.position.y(),
                                                     m.position.x(),
                                                     m.position.y(),
                                                     m.step.force.x(),
                                                     m.step.force.y(),
                                                     m.true_force.x(),
                                                     m.energy,
                                                     limited ? 1.0 : 0.0};
    rows_.insert(rows_.end(), row.begin(), row.end());
  }
  return rows_;
}

namespace {

Settings settings_of(double delay_ms, double jitter_ms, double loss_percent, double stiffness, double seed,
                     double law) {
  return {.delay_ms = delay_ms,
          .jitter_ms = jitter_ms,
          .loss_percent = loss_percent,
          .stiffness = stiffness,
          .seed = seed,
          .law = static_cast<std::size_t>(law)};
}

const char* kept(std::string text) {
  static std::string last;
  last = std::move(text);
  return last.c_str();
}

}  // namespace
}  // namespace tendon::playground

using tendon::playground::Playground;

const char* playground_description() { return tendon::playground::kept(tendon::playground::description()); }

const char* playground_command(double delay_ms, double jitter_ms, double loss_percent, double stiffness, double seed,
                               double law) {
  return tendon::playground::kept(tendon::playground::command(
      tendon::playground::settings_of(delay_ms, jitter_ms, loss_percent, stiffness, seed, law)));
}

Playground* playground_create(double delay_ms, double jitter_ms, double loss_percent, double stiffness, double seed,
                              double law, double x, double y) {
  const auto settings = tendon::playground::settings_of(delay_ms, jitter_ms, loss_percent, stiffness, seed, law);
  return std::make_unique<Playground>(settings, x, y).release();
}

void playground_destroy(Playground* playground) { const std::unique_ptr<Playground> owned(playground); }

const double* playground_step(Playground* playground, int count, double x, double y) {
  return playground->step(count, x, y).data();
}
