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
  const bool replays = !options.replay.empty();
  const auto profile = [&](const char* option, const std::string& own, Direction direction) {
    try {
      return resolve_profile(replays ? options.add : own.empty() ? options.profile : own, direction);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument((replays       ? "--add"
                                   : own.empty() ? "--profile"
                                                 : option) +
                                  std::string(": ") + error.what());
    }
  };
  Scenario scenario;
  scenario.seed = options.seed.value_or(std::random_device{}());
  scenario.up = profile("--up", options.up, Direction::kUp);
  scenario.down = profile("--down", options.down, Direction::kDown);
  return scenario;
}

std::unique_ptr<const Trace> trace_of(const NetworkOptions& options) {
  if (options.replay.empty()) return nullptr;
  auto trace = std::make_unique<const Trace>(read_trace(options.replay));
  if (options.at_end && trace->sparse()) {
    throw std::invalid_argument("--at-end: " + options.replay.string() + " is sparse and has no end");
  }
  if (options.seed && options.add.empty()) {
    throw std::invalid_argument("--seed: expected --add, because only an added profile has random numbers");
  }
  return trace;
}

PreparedNetwork prepare_or_throw(const NetworkOptions& options) {
  std::unique_ptr<const Trace> trace = trace_of(options);
  Scenario scenario = scenario_of(options);
  if (trace && !options.add.empty()) {
    if (reorders(*trace, Direction::kUp)) scenario.up.order = Order::kFree;
    if (reorders(*trace, Direction::kDown)) scenario.down.order = Order::kFree;
  }
  const std::uint64_t seed = options.seed.value_or(scenario.seed);
  PreparedNetwork network{
      .seed = seed,
      .networks = {Injector(scenario.up, seed, 0, Direction::kUp), Injector(scenario.down, seed, 0, Direction::kDown)},
      .text = {to_string(scenario.up), to_string(scenario.down)},
      .timeline = {},
      .replay = std::move(trace),
      .playback = {options.replay_by, options.at_end.value_or(TracePlayer::AtEnd::kRepeat), !options.add.empty()}};
  for (const Scenario::Timed& timed : scenario.changes) {
    network.timeline.push_back({timed.at, prepare(timed.change, seed)});
  }
  if (network.replay) {
    const std::string replay = "replay of " + options.replay.string();
    if (!network.playback.add) network.seed = network.replay->seed;
    for (std::string& text : network.text) text = network.playback.add ? replay + ", then " + text : replay;
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
  if (replay && !playback.add) return header;
  header.up = text[0];
  header.down = text[1];
  header.tables = {networks[0].table_hash(), networks[1].table_hash()};
  return header;
}

}  // namespace tendon::injector
