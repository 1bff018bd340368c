// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/explore.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "protocol/wire/header.h"

namespace tendon::simulation {

namespace {

/// `at` counts from the beginning of the world.
struct Event {
  Duration at{};
  std::function<void()> happens;
};

struct AnyDevice {
  std::unique_ptr<Device> device;
  const SimulatedDevice* simulated = nullptr;
};

AnyDevice make_device(const DrawnWorld& drawn) {
  AnyDevice any;
  if (const auto* config = std::get_if<SimulatedDevice::Config>(&drawn.device)) {
    auto made = std::make_unique<SimulatedDevice>(*config);
    any.simulated = made.get();
    any.device = std::move(made);
  } else {
    any.device = std::make_unique<AdversaryDevice>(std::get<AdversaryDevice::Config>(drawn.device), drawn.port.seed);
  }
  return any;
}

void add(World& world, const DrawnClient& client, LocalTime began, Watch watch) {
  const injector::DriftingClock clock(client.clock, began);
  switch (client.kind) {
    case DrawnClient::Kind::kController:
      world.add_controller(client.config, make_physics(client), clock);
      break;
    case DrawnClient::Kind::kObserver:
      world.add_observer(client.config, std::move(watch), clock);
      break;
    case DrawnClient::Kind::kRogue: {
      Rogue::Config config = client.rogue;
      config.quits += began.time_since_epoch();
      world.add_custom_client(
          [&](Link& link, const Address& server) { return std::make_unique<Rogue>(link, server, config); });
      break;
    }
  }
}

void forge_garbage(World& world, const DrawnWorld& drawn, Dice& dice) {
  std::vector<std::byte> bytes(1 + dice.bits() % kMaxDatagram);
  for (std::byte& b : bytes) b = static_cast<std::byte>(dice.bits());
  Address from = world.server_address();
  from.port = dice.chance(0.5) ? 9 : kFirstClientPort;
  if (dice.chance(0.5) && bytes.size() >= 4) {
    bytes[0] = std::byte{0x54};
    bytes[1] = static_cast<std::byte>(0x10 | (1 + dice.bits() % 4));
    bytes[2] = bytes[3] = std::byte{0};
  }
  if (drawn.sealed() && dice.chance(0.5) && bytes.size() >= kHeaderSize) {
    std::ranges::copy(encode_header({.type = DatagramType::kData,
                                     .suite = drawn.config.suites.front(),
                                     .epoch = static_cast<std::uint8_t>(dice.bits() % 3),
                                     .connection_id = static_cast<std::uint32_t>(1 + dice.bits() % 4),
                                     .packet_number = dice.bits() % 10'000}),
                      bytes.begin());
  }
  world.network().forge(from, world.server_address(), bytes);
}

}  // namespace

Outcome run(const DrawnWorld& drawn, const Extras& extras) {
  AnyDevice device = make_device(drawn);
  WatchedDevice port(*device.device, drawn.port);
  World::Config config = drawn.config;
  config.players = extras.players;
  World world(config, port);
  if (extras.watch) world.network().watch(extras.watch);
  InvariantChecker checker(drawn, world, port, device.simulated);
  world.watch_steps([&](const StepRecord& step) { checker.see(step); });
  world.watch_turns([&](const World::Turn& turn) { checker.see(turn); });

  const LocalTime began = world.now();
  std::vector<Event> events;
  for (std::size_t i = 0; i < drawn.clients.size(); ++i) {
    const DrawnClient& client = drawn.clients[i];
    events.push_back({client.joins, [&world, &client, &checker, i, began] {
                        add(world, client, began,
                            [&checker, i](const DeviceState& state, const LinkStats&) { checker.see_state(i, state); });
                      }});
    if (client.killed) {
      events.push_back({*client.killed, [&world, &checker, i] {
                          world.kill(i);
                          // On a good network as well, the other clients wait until the server has timed out this one.
                          if (checker.recovered_by()) checker.weather_clears(world.network().latest_arrival());
                        }});
    }
    if (client.restarted) {
      events.push_back({*client.restarted, [&world, &client, i] {
                          ForceClient::Config again = client.config;
                          again.seed = client.seed;
                          world.restart_controller(i, again, make_physics(client));
                        }});
    }
  }
  for (const DrawnWorld::Change& change : drawn.changes) {
    events.push_back({change.at, [&world, &change] { world.network().change(change.weather, world.now()); }});
  }
  Dice garbage(drawn.seed ^ 0x6a09e667f3bcc908);
  if (drawn.garbage_hz > 0) {
    for (Duration at{}; at < drawn.clears; at += from_seconds(1 / drawn.garbage_hz)) {
      events.push_back({at, [&world, &drawn, &garbage] { forge_garbage(world, drawn, garbage); }});
    }
  }
  events.push_back({drawn.clears, [&] {
                      port.heal();
                      checker.weather_clears(world.network().latest_arrival());
                    }});
  std::ranges::stable_sort(events, {}, &Event::at);

  const auto run_until = [&](LocalTime until) {
    if (until > world.now()) world.run_for(until - world.now());
  };
  try {
    for (const Event& event : events) {
      run_until(began + event.at);
      event.happens();
    }
    const LocalTime end = began + DrawnWorld::kLength;
    if (const auto by = checker.recovered_by(); by && *by < end) {
      run_until(*by);
      checker.see_recovered();
      for (std::size_t i = 0; i < drawn.clients.size(); ++i) {
        if (drawn.clients[i].kind == DrawnClient::Kind::kController && world.alive(i)) world.client(i).rearm();
      }
    }
    run_until(end);
    checker.see_end();
  } catch (const std::runtime_error& error) {
    checker.report(Oracle::kCalm, error.what());
  }

  Outcome outcome;
  outcome.breach = checker.breach();
  if (outcome.breach) outcome.breach->at = LocalTime(outcome.breach->at - began);
  outcome.felt = checker.felt();
  outcome.limited = checker.limited();
  outcome.turned = checker.turned();
  outcome.gripped = checker.gripped();
  outcome.presses = checker.presses();
  outcome.recovered = checker.checked_recovery();
  outcome.least_energy = checker.least_energy();
  outcome.steps = world.haptic().stats().steps;
  outcome.network = world.network().counts();
  return outcome;
}

}  // namespace tendon::simulation
