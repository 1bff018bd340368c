// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/bridge/bridged_device.h"
#include "devices/simulated/simulated_device.h"
#include "server/assembly.h"
#include "tests/support/wire.h"

namespace tendon::bridge {

/// A server and its bridges in virtual time, with one of the shipped scenes. The haptic loop is run at 1 kHz, and there
/// is a delay of `delay` in each direction. Only the simulated device is random.
class World {
 public:
  explicit World(const std::string& scene_file, const std::vector<std::string>& settings = {}, int delay_ms = 0)
      : scene_(parse_scene(text_of(scene_file), scene_file, ".", settings)), delay_ms_(delay_ms) {
    open_server();
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Each BridgedDevice uses two sessions, which are two clients for the server.
  BridgedDevice& add_bridged(BridgedDevice::Config config = {}) {
    config.new_seed = [this] {
      Seed seed;
      seed.bytes[0] = static_cast<std::byte>(++seeds_);
      return seed;
    };
    Guest& guest = guests_.emplace_back();
    const auto n = std::to_string(guests_.size());
    guest.watcher = std::make_unique<End>(wire_, parse_address("127.0.0.2:1" + n));
    guest.controller = std::make_unique<End>(wire_, parse_address("127.0.0.3:1" + n));
    guest.bridged =
        std::make_unique<BridgedDevice>(BridgedDevice::Route{*guest.watcher, kServer},
                                        BridgedDevice::Route{*guest.controller, kServer}, std::move(config), now);
    return *guest.bridged;
  }

  /// Calls `each` once per millisecond, after the turns of the bridged devices.
  void run(int milliseconds, const std::function<void()>& each = nullptr) {
    for (int i = 0; i < milliseconds; ++i) {
      now += std::chrono::milliseconds(1);
      turn_server();
      if (assembly_) assembly_->haptic_groups().front().turn(now);
      turn_server();
      turn_bridged();
      if (each) {
        each();
        turn_bridged();
      }
      carry();
    }
  }

  /// Stops the server without a Bye. If a new server is started, it does not know the sessions of the old one.
  void kill_server() { assembly_.reset(); }
  void open_server() {
    ++epoch_;
    assembly_.reset();
    device_ = std::make_unique<SimulatedDevice>(scene_.simulated());
    Assembly::Config config{.now = now, .watched = Mailboxes::Capacities{.steps = 16, .flight = 2, .datagrams = 1}};
    config.network.secret.fill(std::byte{7});
    config.network.first_connection_id = 1000 * epoch_;
    assembly_ =
        std::make_unique<Assembly>(std::vector<Assembly::Part>{{.scene = scene_, .device = *device_, .handle = handle}},
                                   config, std::vector<Link*>{&server_});
    assembly_->turn_network(0, now);
  }

  std::size_t unread() const {
    std::size_t all = 0;
    for (const Guest& guest : guests_) all += guest.watcher->inbox.size() + guest.controller->inbox.size();
    return all;
  }

  bool connected = true;
  LocalTime now = LocalTime(std::chrono::seconds(1000));
  StepRecord step;
  /// J, minimum of the energy ledger; negative if the device generates energy
  double least_energy = 0;
  HandleDescription handle;        ///< used when the server is restarted
  std::optional<Safety> safety{};  ///< in the reports of the server, once per second; empty: there are no reports

 private:
  struct Guest {
    std::unique_ptr<End> watcher;
    std::unique_ptr<End> controller;
    std::unique_ptr<BridgedDevice> bridged;
  };
  struct UnderWay {
    LocalTime due;
    Datagram datagram;
  };
  inline static const Address kServer = parse_address("127.0.0.1:47100");

  static std::string text_of(const std::string& scene) {
    std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "deploy" / "scenes" / scene);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  void turn_server() {
    if (!assembly_) return;
    assembly_->turn_network(0, now);
    Mailboxes& mail = assembly_->devices().front().mail;
    if (safety) mail.health.put({.at = now, .safety = *safety});
    while (const StepRecord* record = mail.steps.front()) {
      step = *record;
      least_energy = std::min(least_energy, record->energy);
      mail.steps.pop();
    }
  }
  void turn_bridged() {
    for (Guest& guest : guests_) {
      while (guest.bridged->turn(now) <= now) {
      }
    }
    collect();
  }
  void collect() {
    for (; !wire_.empty(); wire_.pop_front()) {
      if (connected) under_way_.push_back({now + std::chrono::milliseconds(delay_ms_), std::move(wire_.front())});
    }
  }
  void carry() {
    collect();
    for (; !under_way_.empty() && under_way_.front().due <= now; under_way_.pop_front()) {
      const Datagram& datagram = under_way_.front().datagram;
      if (datagram.to == kServer) server_.inbox.push_back(datagram);
      for (Guest& guest : guests_) {
        for (End* end : {guest.watcher.get(), guest.controller.get()}) {
          if (end->self == datagram.to) end->inbox.push_back(datagram);
        }
      }
    }
  }

  Scene scene_;
  int delay_ms_;
  std::uint32_t epoch_ = 0;
  int seeds_ = 0;
  Wire wire_;
  End server_{wire_, kServer};
  std::deque<UnderWay> under_way_;
  std::unique_ptr<SimulatedDevice> device_;
  std::unique_ptr<Assembly> assembly_;
  std::deque<Guest> guests_;
};

}  // namespace tendon::bridge
