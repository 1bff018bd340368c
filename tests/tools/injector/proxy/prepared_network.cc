// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/prepared_network.h"

#include <random>
#include <stdexcept>
#include <utility>

#include "server/machine/regular_file.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::injector {
namespace {

Scenario scenario_of(const NetworkOptions& options) {
  if (!options.scenario.empty()) {
    Scenario scenario = read_scenario(options.scenario);
    if (scenario.clock) {
      throw std::invalid_argument("--scenario " + options.scenario.string() + ": [clock] is only for simulations");
    }
    return scenario;
  }
  const auto profile = [&](const char* option, const std::string& own, Direction direction) {
    try {
      return resolve_profile(own.empty() ? options.profile : own, direction);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(std::string(own.empty() ? "--profile" : option) + ": " + error.what());
    }
  };
  Scenario scenario;
  scenario.seed = options.seed.value_or(std::random_device{}());
  scenario.up = profile("--up", options.up, Direction::kUp);
  scenario.down = profile("--down", options.down, Direction::kDown);
  return scenario;
}

PreparedNetwork prepare_or_throw(const NetworkOptions& options) {
  const Scenario scenario = scenario_of(options);
  const std::uint64_t seed = options.seed.value_or(scenario.seed);
  PreparedNetwork network{
      .seed = seed,
      .networks = {Injector(scenario.up, seed, 0, Direction::kUp), Injector(scenario.down, seed, 0, Direction::kDown)},
      .text = {to_string(scenario.up), to_string(scenario.down)},
      .timeline = {},
      .replay = {},
      .replay_by = options.replay_by};
  for (const Scenario::Timed& timed : scenario.changes) {
    network.timeline.push_back({timed.at, prepare(timed.change, seed)});
  }
  if (!options.replay.empty()) {
    network.replay = std::make_unique<const Trace>(read_trace(options.replay));
    network.seed = network.replay->seed;
    network.text.fill("replay of " + options.replay.string());
  }
  return network;
}

}  // namespace

Proxy::PreparedChange prepare(const Change& change, std::uint64_t seed) {
  Proxy::PreparedChange prepared{.client = change.link, .to = {}, .text = change.text};
  if (change.up) prepared.to[0].emplace(*change.up, seed, 0, Direction::kUp);
  if (change.down) prepared.to[1].emplace(*change.down, seed, 0, Direction::kDown);
  return prepared;
}

PreparedNetwork prepare(const NetworkOptions& options) {
  try {
    return prepare_or_throw(options);
  } catch (const UnreadableFile&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(error.what());
  }
}

TraceHeader PreparedNetwork::header() const {
  TraceHeader header;
  header.seed = seed;
  if (replay) return header;
  header.up = text[0];
  header.down = text[1];
  header.tables = {networks[0].table_hash(), networks[1].table_hash()};
  return header;
}

}  // namespace tendon::injector
