// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/guests/couple.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"
#include "tests/support/wire.h"

namespace tendon {

/// The text of a shipped scene, and what it says with `settings`.
inline std::string text_of(const std::string& scene) {
  std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "deploy" / "scenes" / scene);
  return {std::istreambuf_iterator<char>(file), {}};
}
inline Scene scene_of(const std::string& name, const std::vector<std::string>& settings = {}) {
  return parse_scene(text_of(name), name, ".", settings);
}

/// A server with one coupled device, on virtual time; or one that knows of no coupling.
struct Place {
  /// `key`: with which the one dials and the other lets in.
  Place(Wire& wire, const Scene& the_scene, std::uint64_t epoch, LocalTime now, bool is_coupled = true,
        const std::optional<Key>& key = {})
      : scene(the_scene), end(wire, scene.network.listen), device(scene.simulated()) {
    const Coupling::Config& coupling = *scene.loop.control.coupling;
    scene.loop.control.coupling->spring.epoch = epoch;
    haptic = std::make_unique<HapticLoop>(scene.loop, device, *mail);
    NetworkLoop::Config config;
    config.secret.fill(std::byte{7});
    config.first_connection_id = static_cast<std::uint32_t>(1000 * epoch);
    DeviceDescription about{.name = scene.name, .model = "device", .loop_hz = 1000};
    for (const Scene::Channel& channel : scene.channels) {
      about.channels.push_back({.name = channel.name, .lease = channel.lease});
    }
    config.devices = {about};
    if (is_coupled) {
      config.couplings = {couple_of(coupling)};
      auto& leaders = config.leaders.emplace_back();
      for (const CoupledLeader& leader : scene.loop.control.leaders) leaders.push_back(leader.channel);
    }
    if (is_coupled && scene.teleoperation->dial) {
      config.dials.push_back({0,
                              {.server = *scene.teleoperation->dial,
                               .name = scene.name,
                               .key = key,
                               .seed = epoch,
                               .channel = scene.teleoperation->channel,
                               .couple = *config.couplings[0]}});
    } else if (key) {
      config.keys = {{.name = "leader", .role = Role::kController, .key = *key}};
    }
    network = std::make_unique<NetworkLoop>(config, end, std::vector<Mailboxes*>{mail.get()});
    network->turn(now);
  }

  void step(LocalTime now) {
    haptic->step(now);
    network->turn(now);
    for (const PortRecord* port = mail->ports.front(); port != nullptr; port = mail->ports.front()) {
      ports_[port->channel] = *port;
      mail->ports.pop();
    }
    while (const StepRecord* record = mail->steps.front()) {
      least_energy = std::min(least_energy, record->energy);
      if (record->grip() != nullptr) least_energy = std::min(least_energy, record->grip()->energy);
      if (record->handle) handle = *record->handle;
      position = record->hand.position;
      force = record->applied;
      mail->steps.pop();
    }
    for (const auto& said : network->take_notices()) notices.push_back(said.text);
  }

  /// Of the coupling by that channel, in the newest step; of a device with one coupling channel 0.
  const PortRecord& newest(std::uint32_t channel = 0) { return ports_[channel]; }
  PortPhase phase(std::uint32_t channel = 0) { return newest(channel).sent.phase; }
  bool said(const std::string& words) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  Scene scene;
  End end;
  SimulatedDevice device;
  std::unique_ptr<Mailboxes> mail =
      std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .ports = 32, .flight = 2, .datagrams = 1});
  std::unique_ptr<HapticLoop> haptic;
  std::unique_ptr<NetworkLoop> network;
  double least_energy = 0;  ///< J, of all accounts of the device
  Vec3 position = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  HandleStep handle;
  std::vector<std::string> notices;

 private:
  std::map<std::uint32_t, PortRecord> ports_;  ///< by channel
};

}  // namespace tendon
