// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "server/network_loop.h"
#include "tests/support/wire.h"

// Network half of the server with real clients and forgers, in virtual time on a perfect network.

namespace tendon {

inline ClientKey key_of(const std::string& name, Role role, std::uint64_t seed) {
  return {.name = name, .role = role, .key = Ratchet(seed).next()};
}

/// Z is the server; tests add the clients.
class SealedServer : public ::testing::Test {
 protected:
  struct Client {
    std::unique_ptr<End> end;
    std::unique_ptr<ForceClient> client;
  };

  SealedServer() {
    NetworkLoop::Config config;
    config.keys = {wall_, other_, screen_};
    restart(config);
  }

  void restart(NetworkLoop::Config config) {
    config.secret.fill(std::byte{7});
    if (config.devices.empty()) {
      config.devices = {
          {.about = {.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}}}};
    }
    config.devices[0].mail = mail_.get();
    if (config.devices.size() > 1) {
      second_ = std::make_unique<Mailboxes>(Mailboxes::Capacities{.datagrams = 1});
      config.devices[1].mail = second_.get();
    }
    loop_ = std::make_unique<NetworkLoop>(config, server_, now_);
  }

  static ForceClient::Config config_of(const std::optional<ClientKey>& key, std::uint64_t seed) {
    ForceClient::Config config;
    config.name = key ? key->name : "plain";
    if (key) config.key = key->key;
    config.seed = seed;
    return config;
  }
  Client controller(const std::optional<ClientKey>& key, const std::string& address) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config_of(key, ++seed_), [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); },
        now_);
    return client;
  }
  Client observer(const std::optional<ClientKey>& key, const std::string& address) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config_of(key, ++seed_), [](const DeviceState&, const LinkStats&) {}, now_);
    return client;
  }

  /// Returns a client restricted to these suites, like an older one or another processor.
  Client of_suites(const ClientKey& key, const std::string& address, const Suites& suites, bool controls) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.suites = suites;
    if (controls) {
      client.client = std::make_unique<ForceClient>(
          *client.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
    } else {
      client.client = std::make_unique<ForceClient>(
          *client.end, server_.self, config, [](const DeviceState&, const LinkStats&) {}, now_);
    }
    return client;
  }

  /// Advances time by 1 ms and one device step at a time. `on_the_way` may change or drop datagrams.
  template <class OnTheWay>
  void run(Duration length, std::vector<Client*> clients, OnTheWay on_the_way) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += std::chrono::milliseconds(1)) {
      DeviceState state = look_;
      state.tick = tick_ += tick_step_;
      state.sampled = PeerTime(now_.time_since_epoch());
      state.force_wanted = wanted_;
      if (wanted_) state.stiffness_wanted = Mat3::Identity();
      state.buttons = buttons_;
      mail_->state.put(state);
      if (measured_) {
        ++health_.steps;
        ++health_.lateness[tick_ % 10];
        health_.at = now_;
        mail_->health.put(health_);
        if (second_) second_->health.put(health_);
      }
      if (second_) {
        state.device = 1;
        second_->state.put(state);
      }
      if (tick_ % steps_a_turn_ == 0) loop_->turn(now_);
      for (Client* client : clients) client->client->turn(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) {
        Datagram datagram = wire_[count_];
        if (!on_the_way(datagram)) continue;
        if (datagram.to == server_.self) server_.inbox.push_back(datagram);
        for (Client* client : clients) {
          if (datagram.to == client->end->self) client->end->inbox.push_back(datagram);
        }
      }
    }
  }
  void run(Duration length, std::vector<Client*> clients) {
    run(length, std::move(clients), [](Datagram&) { return true; });
  }
  void deliver(const Address& from, const Bytes& bytes) { server_.inbox.push_back({from, server_.self, bytes}); }
  /// Runs a foreign, unencrypted controller for `length`. It answers each state with a valid force changed by `spoil`,
  /// and does nothing while `sleeps` returns true. Returns its newest report.
  template <class Spoil, class Sleeps>
  std::optional<LinkReport> run_foreign(Duration length, Spoil spoil, Sleeps sleeps) {
    End end(wire_, parse_address("127.0.0.1:4000"));
    ClientHandshake handshake({.hello = foreign_}, now_);
    std::optional<Session> session;
    std::optional<LinkReport> report;
    std::uint64_t sequence = 0;
    std::array<std::byte, kMaxDatagram> buffer;
    const auto say = [&](auto& mine) {
      while (const std::size_t size = mine.next_datagram(now_, buffer)) {
        deliver(end.self, Bytes(buffer.begin(), buffer.begin() + static_cast<int>(size)));
      }
    };
    for (const LocalTime start = now_; now_ - start < length;) {
      const bool awake = !sleeps(now_ - start);
      if (awake) session ? say(*session) : say(handshake);
      run(std::chrono::milliseconds(1), {});
      count_ = 0;
      const Wire arrived = std::exchange(wire_, {});
      if (!awake) continue;  // its socket overflows
      for (const Datagram& datagram : arrived) {
        session ? void(session->receive(now_, datagram.bytes)) : handshake.receive(now_, datagram.bytes);
      }
      if (!session && handshake.outcome()) {
        const auto& accepted = std::get<ClientHandshake::Accepted>(*handshake.outcome());
        session.emplace(Session::Config{.connection_id = accepted.connection_id}, now_);
      }
      while (const auto event = session ? session->next_event() : nullptr) {
        if (const auto* told = std::get_if<Session::ReportArrived>(&*event)) report = told->report;
        const auto* seen = std::get_if<Session::StateArrived>(&*event);
        if (seen == nullptr) continue;
        ForceCommand force;
        force.sequence = ++sequence;
        force.based_on_tick = seen->state.tick;
        force.force = Vec3(1, 0, 0);
        force.valid_for = std::chrono::milliseconds(20);
        spoil(force);
        session->send(force);
      }
    }
    return report;
  }
  template <class Spoil>
  std::optional<LinkReport> run_foreign(Duration length, Spoil spoil) {
    return run_foreign(length, spoil, [](Duration) { return false; });
  }
  /// Returns an observer that requests all features. `seen` receives its newest state.
  Client diagnosing(const std::optional<ClientKey>& key, const std::string& address, const std::string& device = {},
                    DeviceState* seen = nullptr) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.diagnostics = true;
    config.device = device;
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config,
        [seen](const DeviceState& state, const LinkStats&) {
          if (seen != nullptr) *seen = state;
        },
        now_);
    return client;
  }
  static ForceClient::Phase phase(const Client& client) { return client.client->phase(); }

  ClientKey wall_ = key_of("wall", Role::kController, 1);
  ClientKey other_ = key_of("other", Role::kController, 2);
  ClientKey screen_ = key_of("screen", Role::kObserver, 3);
  LocalTime now_{std::chrono::seconds(1000)};
  Wire wire_;
  std::size_t count_ = 0;  ///< delivered datagrams of the wire
  End server_{wire_, parse_address("192.0.2.100:47100")};
  std::unique_ptr<Mailboxes> mail_ = std::make_unique<Mailboxes>();
  std::unique_ptr<Mailboxes> second_;  ///< of a second device
  std::unique_ptr<NetworkLoop> loop_;
  std::uint64_t tick_ = 0;
  std::uint64_t tick_step_ = 1;
  std::uint64_t steps_a_turn_ =
      1;                        ///< if this is greater than 1, the network thread is late and only sees the newest step
  std::optional<Vec3> wanted_;  ///< set by the device's loop
  std::uint32_t buttons_ = 0;   ///< set by the device's loop
  DeviceState look_;            ///< set by the loop of the device (other fields)
  bool measured_ = false;       ///< the log thread reports health
  Health health_;
  std::uint64_t seed_ = 10;
  Hello foreign_{.role = Role::kController, .name = "foreign", .features = {}};  ///< of run_foreign()
};

using Phase = ForceClient::Phase;

/// A server with a device "left" with one channel, and a device "right" with two, the second of which has a lease.
class TwoDevices : public SealedServer {
 protected:
  TwoDevices() {
    NetworkLoop::Config config;
    config.keys = {wall_, other_, screen_};
    config.takeover = {"other"};
    config.devices = {{.about = {.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}}},
                      {.about = {.name = "right",
                                 .model = "device",
                                 .loop_hz = 1000,
                                 .channels = {{.name = "guidance"},
                                              {.name = "tissue",
                                               .rule = ChannelRule::kPriority,
                                               .lease = std::chrono::milliseconds(500),
                                               .holder = {}}}}}};
    restart(config);
  }

  Client controller_of(const ClientKey& key, const std::string& address, const std::string& device,
                       const std::string& channel, bool take_lease = false) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.device = device;
    config.channel = channel;
    config.take_lease = take_lease;
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
    return client;
  }
  NetworkLoop::Stats::Channel tissue() const { return loop_->stats().channels.at(2); }
};

}  // namespace tendon
