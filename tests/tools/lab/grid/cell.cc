// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/cell.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/nearest_word.h"
#include "core/control/catalogue.h"
#include "core/control/preset.h"
#include "core/ledger/energy_ledger.h"
#include "devices/simulated/simulated_device.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/injector/traces/trace_player.h"
#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/recordings/contact.h"
#include "tests/tools/worlds/world.h"

namespace tendon::lab {
namespace {

using simulation::Network;
using simulation::World;

/// Worlds start at one second; a trace is shifted to match.
constexpr LocalTime kBegin{std::chrono::seconds(1)};

constexpr std::string_view kTracePrefix = "trace:";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The settings that replace the limiter of `scene` (parse_scene).
std::vector<std::string> settings_for(const std::string& law, const Scene& scene) {
  std::string known = "scene";
  for (const PresetInfo& preset : presets()) {
    if (law == preset.name) {
      std::vector<std::string> settings = limiter_settings(info(Law::kAolPlus).name, scene.loop.control);
      settings.push_back("limiter.preset=\"" + law + '"');
      return settings;
    }
    known += ", " + std::string(preset.name);
  }
  if (const auto found = law_named(law)) return limiter_settings(info(*found).name, scene.loop.control);
  for (const LawInfo& each : laws()) known += ", " + std::string(each.name);
  throw std::invalid_argument("expected one of " + known + ", found \"" + law + '"' + did_you_mean(law, known));
}

/// Delays and losses of the datagrams of one run, by direction.
class Delays {
 public:
  void add(injector::Direction direction, const injector::Decision& decision) {
    if (decision.verdict == injector::Verdict::kDrop) {
      ++lost_;
    } else {
      delays_.at(static_cast<std::size_t>(direction)).push_back(decision.release - decision.arrival);
    }
  }
  std::optional<double> round_trip() {
    double sum = 0;
    for (std::vector<Duration>& delays : delays_) {
      if (delays.empty()) return std::nullopt;
      const auto middle = delays.begin() + static_cast<std::ptrdiff_t>(delays.size() / 2);
      std::ranges::nth_element(delays, middle);
      sum += seconds(*middle);
    }
    return sum;
  }
  std::optional<double> loss() const {
    const std::size_t sent = lost_ + delays_[0].size() + delays_[1].size();
    if (sent == 0) return std::nullopt;
    return static_cast<double>(lost_) / static_cast<double>(sent);
  }

 private:
  std::array<std::vector<Duration>, 2> delays_{};
  std::size_t lost_ = 0;
};

}  // namespace

GridBench::GridBench(const std::filesystem::path& scene) : file_(scene), scene_(read_scene(scene)) {
  if (scene_.count > 1) {
    throw std::invalid_argument(scene.string() +
                                ": expected a scene with one device, found count = " + std::to_string(scene_.count));
  }
  if (!std::holds_alternative<SimulatedDevice::Config>(scene_.device)) {
    throw std::invalid_argument(scene.string() + ": expected a simulated device, found kind = \"" +
                                std::string(scene_.driver().kind) + '"');
  }
  if (scene_.teleoperation) {
    throw std::invalid_argument(scene.string() +
                                ": expected a scene without [teleoperation], because the grid has no " +
                                "other device; see tendon-lab teleop");
  }
  text_ = text_of(scene);
}

const Scene& GridBench::scene_of(const std::string& law) {
  if (const auto known = laws_.find(law); known != laws_.end()) return known->second;
  Scene scene = law == "scene" ? scene_
                               : parse_scene(text_, file_.string() + " with the limiter \"" + law + '"',
                                             file_.parent_path(), settings_for(law, scene_));
  make_law(scene.loop.control.limiter);
  return laws_.emplace(law, std::move(scene)).first->second;
}

std::string GridBench::parts_of(const std::string& law) {
  const Scene& scene = scene_of(law);
  constexpr std::string_view kLimiter = "limiter.";
  std::string parts;
  for (const ScenePart& part : scene_parts()) {
    Scene without = scene;
    if (!part.key.starts_with(kLimiter) || !take_out(without, part.key)) continue;
    parts += (parts.empty() ? "" : " ") + part.key.substr(kLimiter.size());
  }
  return parts.empty() ? "none" : parts;
}

void GridBench::add_network(const std::string& network) {
  Path path;
  if (network.starts_with(kTracePrefix)) {
    path.trace = injector::read_trace(std::filesystem::path(network.substr(kTracePrefix.size())));
    if (path.trace->records.empty())
      throw std::invalid_argument(network + ": expected a trace with datagrams, found none");
  } else {
    path.weather = {.up = injector::resolve_profile(network, injector::Direction::kUp),
                    .down = injector::resolve_profile(network, injector::Direction::kDown)};
  }
  networks_.emplace(network, std::move(path));
}

std::optional<Duration> GridBench::length_of(const std::string& network) const {
  const auto& trace = networks_.at(network).trace;
  if (!trace) return std::nullopt;
  LocalTime end = trace->start;
  for (const injector::TraceRecord& record : trace->records) end = std::max(end, record.arrival);
  return end - trace->start;
}

Measured GridBench::run(const GridCell& cell, Duration length) const {
  const Scene& scene = laws_.at(cell.law);
  const Path& path = networks_.at(cell.network);
  SimulatedDevice device(scene.simulated());
  World::Config config;
  config.seed = cell.seed;
  config.loop = scene.loop;
  config.loop.control.limiter.environment_stiffness = cell.stiffness;
  config.mail.flight = 1;
  config.weather = path.weather;
  if (path.trace) {
    config.players = [&path](injector::Direction direction, std::uint32_t link) {
      return std::make_unique<injector::TracePlayer>(*path.trace, direction, link, injector::TracePlayer::By::kTime,
                                                     kBegin);
    };
  }
  World world(config, device);
  const auto wall = [&cell](const Vec3& at) { return Vec3(-cell.stiffness * std::max(0.0, at.x()), 0, 0); };
  ForceClient::Config engine;
  engine.name = "wall";
  engine.rate_hz = cell.rate_hz;
  world.add_controller(engine, [&wall](const DeviceState& hand) -> Touch { return wall(hand.position); });

  Delays delays;
  world.network().watch([&delays](injector::Direction direction, std::uint32_t /*link*/,
                                  const injector::Decision& decision) { delays.add(direction, decision); });
  EnergyLedger ledger(least_friction(scene.simulated()));
  std::vector<Moment> record;
  std::vector<FeltStep> felt;
  std::optional<LocalTime> before;
  Vec3 motor = Vec3::Zero();
  Vec3 applied = Vec3::Zero();
  bool served = false;
  world.watch_steps([&](const StepRecord& step) {
    const SimulatedDevice::Truth& truth = device.truth();
    const Vec3 motor_now = truth.position + truth.deflection;
    if (before) ledger.observe<3>(applied, motor_now - motor, step.hand.at - *before);
    before = step.hand.at;
    motor = motor_now;
    applied = step.applied;
    served = served || step.force_sequence > 0;
    if (!served) return;
    Moment& moment = record.emplace_back();
    moment.step = step;
    moment.step.force = step.applied;
    moment.t = seconds(step.hand.at.time_since_epoch());
    moment.position = truth.position;
    moment.velocity = truth.velocity;
    moment.true_force = wall(truth.position);
    moment.energy = ledger.energy();
    felt.push_back({truth.position, step.applied});
  });
  world.run_for(length);

  Measured measured{.round_trip = delays.round_trip(), .loss = delays.loss()};
  if (record.empty()) return measured;
  const Outcome result = outcome(record, scene.loop.period);
  measured.felt_stiffness = felt_stiffness(felt, Vec3::UnitX(), {.above = 0.0, .below = {}});
  measured.least_energy = result.least_energy;
  measured.vibration = result.late_vibration;
  measured.felt_db = result.sensation;
  measured.force_error = result.force_error;
  measured.limited_share = result.limited_share;
  return measured;
}

}  // namespace tendon::lab
