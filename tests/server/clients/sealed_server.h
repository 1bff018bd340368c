// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "protocol/wire/header.h"
#include "tests/server/clients/foreign.h"
#include "tests/server/servers.h"

// Network loops with real clients and forgers, in virtual time on a perfect network. There are no haptic loops: the
// test writes the states into the mailboxes and reads the forces from them.

namespace tendon {

inline ClientKey key_of(const std::string& name, Role role, std::uint64_t seed) {
  return {.name = name, .role = role, .key = Ratchet(seed).next()};
}

inline Watch into(DeviceState& seen) {
  return [&seen](const DeviceState& state, const LinkStats&) { seen = state; };
}
inline Touch push(const DeviceState&) { return Vec3(1, 0, 0); }

/// Z is the server; tests add the clients.
class SealedServer : public Servers {
 protected:
  struct Client {
    std::unique_ptr<End> end;
    std::unique_ptr<ForceClient> client;
    ForceClient* operator->() const { return client.get(); }
  };

  SealedServer() {
    config_.secret.fill(std::byte{7});
    config_.keys = {wall_, other_, screen_};
    restart();
  }

  void restart() {
    serve(scenes_, shards_, {.network = config_, .watched = Mailboxes::Capacities{.steps = 1, .flight = 2}});
  }
  void restart_without_keys() {
    config_.keys.clear();
    restart();
  }
  /// Starts a server with the devices "d-0", "d-1" …
  void restart_with_many(std::uint32_t devices, std::size_t shards) {
    scenes_.assign(devices, device_named("d"));
    for (std::uint32_t i = 0; i < devices; ++i) scenes_[i].name = "d-" + std::to_string(i);
    shards_ = shards;
    restart();
  }

  NetworkLoop& loop(std::size_t shard = 0) { return assembly_->network(shard); }
  NetworkLoop::Stats stats(std::size_t shard = 0) { return loop(shard).stats(); }
  std::vector<std::string> take_notices(std::size_t shard = 0) {
    std::vector<std::string> said;
    for (const auto& notice : loop(shard).take_notices()) said.push_back(notice.text);
    return said;
  }

  template <class Callback>
  Client join(const std::optional<ClientKey>& key, const std::string& address, ForceClient::Config config,
              Callback callback) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    config.name = key ? key->name : "plain";
    if (key) config.key = key->key;
    config.seed = ++seed_;
    client.client = std::make_unique<ForceClient>(*client.end, server_, config, std::move(callback), now_);
    return client;
  }
  Client controller(const std::optional<ClientKey>& key, const std::string& address,
                    const ForceClient::Config& config = {}, Physics physics = push) {
    return join(key, address, config, std::move(physics));
  }
  Client observer(
      const std::optional<ClientKey>& key, const std::string& address, const ForceClient::Config& config = {},
      Watch watch = [](const DeviceState&, const LinkStats&) {}) {
    return join(key, address, config, std::move(watch));
  }

  /// Advances by 1 ms and one device step at a time. `on_the_way` may change or drop datagrams.
  template <class OnTheWay>
  void run(Duration length, const std::vector<Client*>& clients, const OnTheWay& on_the_way) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += std::chrono::milliseconds(1)) {
      put_states();
      if (tick_ % steps_a_turn_ == 0) turn();
      for (Client* client : clients) (*client)->turn(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) {
        Datagram datagram = wire_[count_];
        if (!on_the_way(datagram)) continue;
        if (datagram.to == server_) deliver(datagram.from, datagram.bytes);
        for (Client* client : clients) {
          if (datagram.to == client->end->self) client->end->inbox.push_back(datagram);
        }
      }
    }
  }
  void run(Duration length, const std::vector<Client*>& clients) {
    run(length, clients, [](Datagram&) { return true; });
  }
  /// Device i is at the x position i.
  void put_states() {
    tick_ += tick_step_;
    ++health_.steps;
    ++health_.lateness[tick_ % 10];
    health_.at = now_;
    for (std::size_t i = 0; i < scenes_.size(); ++i) {
      DeviceState state = look_;
      state.tick = tick_;
      state.device = static_cast<std::uint32_t>(i);
      state.sampled = PeerTime(now_.time_since_epoch());
      state.position.x() += static_cast<double>(i);
      state.force_wanted = wanted_;
      if (wanted_) state.stiffness_wanted = Mat3::Identity();
      mail(i).state.put(state);
      if (measured_) mail(i).health.put(health_);
    }
  }
  void turn() {
    for (std::size_t i = 0; i < shards_; ++i) assembly_->turn_network(i, now_);
  }
  /// Like UdpLink::several, data goes to the shard that owns the connection, and all other datagrams to the first.
  void deliver(const Address& from, const Bytes& bytes) {
    const auto header = decode_header(bytes);
    const bool of_session = header && header->type == DatagramType::kData;
    ends_[of_session ? header->connection_id % shards_ : 0].inbox.push_back({from, server_, bytes});
  }

  template <class Take>
  void run_with(Foreign& client, Duration length, const Take& take) {
    for (const LocalTime end = now_ + length; now_ < end;) {
      client.turn(now_, take);
      run(std::chrono::milliseconds(1), {}, [&](Datagram& datagram) {
        if (datagram.to == client.end.self) client.end.inbox.push_back(datagram);
        return true;
      });
    }
  }
  /// Answers each state with a valid force that is changed by `spoil`. Returns the newest report about it.
  template <class Spoil>
  std::optional<LinkReport> run_foreign(Duration length, const Spoil& spoil) {
    Foreign client(wire_, "127.0.0.1:4000", server_, foreign_, now_);
    std::optional<LinkReport> report;
    std::uint64_t sequence = 0;
    run_with(client, length, [&](const Session::Event& event) {
      if (const auto* told = std::get_if<Session::ReportArrived>(&event)) report = told->report;
      const auto* seen = std::get_if<Session::StateArrived>(&event);
      if (seen == nullptr) return;
      ForceCommand force{.sequence = ++sequence,
                         .based_on_tick = seen->state.tick,
                         .force = Vec3(1, 0, 0),
                         .valid_for = std::chrono::milliseconds(20)};
      spoil(force);
      client.session()->send(force);
    });
    return report;
  }
  /// Names `features` and passes its events to `see`. Returns the features agreed on.
  template <class See>
  std::vector<std::string> run_seeing(const std::vector<std::string>& features, Duration length, const See& see,
                                      Role role = Role::kObserver) {
    Foreign client(wire_, "127.0.0.1:4000", server_, {.role = role, .name = "foreign", .features = features}, now_);
    run_with(client, length, see);
    return client.welcome.value().features;
  }
  Client opened(const std::optional<ClientKey>& key, const std::string& address,
                const ForceClient::Config& config = {}) {
    Client client = controller(key, address, config);
    run(std::chrono::milliseconds(300), {&client});
    return client;
  }
  static ForceClient::Phase phase(const Client& client) { return client->phase(); }

  ClientKey wall_ = key_of("wall", Role::kController, 1);
  ClientKey other_ = key_of("other", Role::kController, 2);
  ClientKey screen_ = key_of("screen", Role::kObserver, 3);
  NetworkLoop::Config config_;
  std::vector<Scene> scenes_ = {device_named("left")};
  std::size_t shards_ = 1;
  std::size_t count_ = 0;  ///< datagrams that the wire has delivered
  std::uint64_t tick_ = 0;
  std::uint64_t tick_step_ = 1;
  std::uint64_t steps_a_turn_ = 1;  ///< if above 1, the network thread is late and only sees the newest step
  DeviceState look_;                ///< set by the loops of the devices
  std::optional<Vec3> wanted_;      ///< set by the loops of the devices
  bool measured_ = false;           ///< whether the log thread reports the health
  Health health_;
  std::uint64_t seed_ = 10;
  Hello foreign_{.role = Role::kController, .name = "foreign", .features = {}};  ///< of run_foreign()
};

using Phase = ForceClient::Phase;

/// A server with a device "left" with one channel, and a device "right" with two, the second of which has a lease.
class TwoDevices : public SealedServer {
 protected:
  TwoDevices() {
    scenes_.push_back(device_named("right",
                                   "[[channel]]\nname = \"guidance\"\n"
                                   "[[channel]]\nname = \"tissue\"\nrule = \"priority\"\nlease_ms = 500\n"));
    scenes_[0].network.takeover = {"other"};
    restart();
  }

  NetworkLoop::Stats::Channel tissue() { return stats().channels.at(2); }
};

}  // namespace tendon
