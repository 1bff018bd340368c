// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/assembly.h"
#include "server/scene/scene.h"
#include "tests/support/wire.h"

namespace tendon {

/// A simulated device with one channel. `more` is appended to its table [device].
inline Scene device_named(const std::string& name, const std::string& more = "") {
  const std::string head = "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\nname = \"";
  return parse_scene(head + name + "\"\n" + more, "s.toml", {});
}

/// Runs a server in virtual time. The test calls the loops.
class Servers : public ::testing::Test {
 protected:
  /// Starts a server with these devices and a network loop for each of `networks` links.
  void serve(const std::vector<Scene>& scenes, std::size_t networks = 1, Assembly::Config config = {}) {
    stop();
    std::vector<Assembly::Part> parts;
    for (const Scene& scene : scenes) {
      parts.push_back({.scene = scene, .device = devices_.emplace_back(scene.simulated())});
    }
    parts.back().handle = handle_;
    std::vector<Link*> links;
    for (std::size_t i = 0; i < networks; ++i) links.push_back(&ends_.emplace_back(wire_, server_));
    config.now = now_;
    assembly_.emplace(std::move(parts), config, links);
  }
  void stop() {
    assembly_.reset();
    devices_.clear();
    ends_.clear();
  }

  Assembly::DeviceLoop& device(std::size_t number = 0) { return assembly_->devices()[number]; }
  Mailboxes& mail(std::size_t device_number = 0) { return device(device_number).mail; }

  LocalTime now_{std::chrono::seconds(1000)};
  const Address server_ = parse_address("127.0.0.1:47100");
  std::optional<HandleDescription> handle_;  ///< of the last device
  Wire wire_;
  std::deque<End> ends_;  ///< the server has one for each network loop
  std::deque<SimulatedDevice> devices_;
  std::optional<Assembly> assembly_;
};

}  // namespace tendon
