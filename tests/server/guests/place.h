// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/assembly.h"
#include "server/guests/couple.h"
#include "tests/support/wire.h"

namespace tendon {

/// Returns the text of a shipped scene and the scene with `settings`.
inline std::string text_of(const std::string& scene) {
  std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "deploy" / "scenes" / scene);
  return {std::istreambuf_iterator<char>(file), {}};
}
inline Scene scene_of(const std::string& name, const std::vector<std::string>& settings = {}) {
  return parse_scene(text_of(name), name, ".", settings);
}

/// A server with one coupled or uncoupled device in virtual time.
struct Place {
  /// `key`: of the connection between both servers.
  Place(Wire& wire, const Scene& the_scene, std::uint64_t epoch, LocalTime now, bool is_coupled = true,
        const std::optional<Key>& key = {})
      : scene(the_scene), end(wire, scene.network.listen), device(scene.simulated()) {
    if (!is_coupled) scene.teleoperation.reset();
    Assembly::Config config{.now = now,
                            .epoch = epoch,
                            .watched = Mailboxes::Capacities{.steps = 16, .ports = 32, .flight = 2, .datagrams = 1}};
    config.network.secret.fill(std::byte{7});
    config.network.first_connection_id = static_cast<std::uint32_t>(1000 * epoch);
    if (key && !scene.dials()) {
      config.network.keys = {{.name = "leader", .role = Role::kController, .key = *key}};
    }
    server.emplace(std::vector<Assembly::Part>{{.scene = scene, .device = device, .dial_key = key, .dial_seed = epoch}},
                   config, std::vector<Link*>{&end});
    server->turn_network(0, now);
  }

  void step(LocalTime now) {
    server->haptic_groups().front().turn(now);
    server->turn_network(0, now);
    for (const PortRecord* port = mail().ports.front(); port != nullptr; port = mail().ports.front()) {
      ports_[port->channel] = *port;
      mail().ports.pop();
    }
    while (const StepRecord* record = mail().steps.front()) {
      least_energy = std::min(least_energy, record->energy);
      if (record->grip() != nullptr) least_energy = std::min(least_energy, record->grip()->energy);
      if (record->handle) handle = *record->handle;
      position = record->hand.position;
      force = record->applied;
      mail().steps.pop();
    }
    for (const auto& said : server->network().take_notices()) notices.push_back(said.text);
  }

  Mailboxes& mail() { return server->devices().front().mail; }
  /// Coupling record of a channel in the newest step; channel 0 if the device has one coupling.
  const PortRecord& newest(std::uint32_t channel = 0) { return ports_[channel]; }
  PortPhase phase(std::uint32_t channel = 0) { return newest(channel).sent.phase; }
  bool said(const std::string& words) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  Scene scene;
  End end;
  SimulatedDevice device;
  std::optional<Assembly> server;
  double least_energy = 0;  ///< J, minimum over all accounts of the device
  Vec3 position = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  HandleStep handle;
  std::vector<std::string> notices;

 private:
  std::map<std::uint32_t, PortRecord> ports_;  ///< by channel
};

}  // namespace tendon
