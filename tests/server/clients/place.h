// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/assembly.h"
#include "server/clients/couple.h"
#include "tests/server/clients/foreign.h"
#include "tests/server/scene/scene_text.h"
#include "tests/support/dice.h"
#include "tests/support/wire.h"

namespace tendon {

/// Runs a server with one device in virtual time.
struct Place {
  /// `key` protects the connection between both servers.
  Place(Wire& wire, const Scene& the_scene, std::uint64_t epoch, LocalTime now, const std::optional<Key>& key = {})
      : scene(the_scene), end(wire, scene.network.listen), device(scene.simulated()) {
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
  /// The coupling record of a channel in the newest step. If the device has only one coupling, it is in channel 0.
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

class Viewer : public Foreign {
 public:
  struct Seen {
    LocalTime at;
    PortFrame port;
  };

  using Foreign::Foreign;
  void turn(LocalTime now) {
    Foreign::turn(now, [&](const Session::Event& event) {
      if (const auto* told = std::get_if<Session::PortArrived>(&event)) {
        (told->port.of_peer ? peers : own).push_back({now, told->port});
      }
      if (const auto* told = std::get_if<Session::RequestAnswered>(&event)) answer = *told;
      states += std::holds_alternative<Session::StateArrived>(event) ? 1 : 0;
    });
  }

  std::vector<Seen> own;
  std::vector<Seen> peers;
  std::size_t states = 0;
  std::optional<Session::RequestAnswered> answer;
};

/// Runs two or three servers with coupled devices, their haptic loops and clients, in virtual time.
class Places : public ::testing::Test {
 protected:
  std::unique_ptr<Place> place(const Scene& scene, std::uint64_t epoch, const std::optional<Key>& key = {}) {
    return std::make_unique<Place>(wire_, scene, epoch, now_, key);
  }

  void run(Duration length, const std::function<void()>& each = {}) {
    for (const LocalTime until = now_ + length; now_ < until; now_ += std::chrono::milliseconds(1)) {
      for (Place* one : places()) one->step(now_);
      for (Viewer* one : clients_) one->turn(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) {
        if (is_cut(wire_[count_]) || dice_.chance(loss_)) continue;
        under_way_.emplace_back(now_ + delay_ + dice_.milliseconds(0, jitter_ms_), wire_[count_]);
      }
      std::erase_if(under_way_, [&](const auto& one) {
        if (one.first > now_) return false;
        for (Place* place : places()) deliver(one.second, place->end);
        for (Viewer* client : clients_) deliver(one.second, client->end);
        return true;
      });
      if (each) each();
    }
  }

  void expect_phase(PortPhase phase) {
    for (Place* one : places()) EXPECT_EQ(one->phase(), phase) << one->scene.name;
  }
  void expect_sound() {
    for (const Place* one : places()) EXPECT_GE(one->least_energy, -1e-9) << one->scene.name;
  }

  Wire wire_;
  LocalTime now_{std::chrono::seconds(1)};
  Duration delay_{};
  double jitter_ms_ = 0;
  double loss_ = 0;
  bool cut_ = false;                  ///< the network is down
  std::optional<Address> cut_off_{};  ///< unreachable address
  Dice dice_{7};
  std::unique_ptr<Place> leader_;
  std::unique_ptr<Place> second_leader_;
  std::unique_ptr<Place> follower_;
  std::vector<Viewer*> clients_;

 private:
  std::vector<Place*> places() {
    std::vector<Place*> all = {leader_.get(), second_leader_.get(), follower_.get()};
    std::erase(all, nullptr);
    return all;
  }
  bool is_cut(const Datagram& datagram) const {
    return cut_ || (cut_off_ && (datagram.from == *cut_off_ || datagram.to == *cut_off_));
  }
  static void deliver(const Datagram& datagram, End& end) {
    if (end.self == datagram.to) end.inbox.push_back(datagram);
  }

  std::size_t count_ = 0;
  std::vector<std::pair<LocalTime, Datagram>> under_way_;
};

}  // namespace tendon
