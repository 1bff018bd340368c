// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "devices/device.h"
#include "protocol/link.h"
#include "server/byte_sink.h"
#include "server/haptic_loop.h"
#include "server/mailboxes.h"
#include "server/network_loop.h"
#include "server/recorder.h"
#include "tests/injector/injector.h"

namespace tendon::simulation {

/// A network of simulated links: what one end sends, the other receives when its injector says so.
/// Each ordered pair of addresses has an injector of its own, seeded by the world; the link is the client's port.
class Network {
 public:
  Network(std::uint64_t seed, const injector::Profile& to_server, const injector::Profile& from_server,
          const Address& server);

  /// An end at `address`. Lives as long as the network.
  Link& open(const Address& address);

  /// Moves the clock: datagrams due by `now` are in the inboxes after it. Returns who has mail.
  std::vector<Address> deliver(LocalTime now);

  /// When the next datagram arrives; empty when none is on its way.
  std::optional<LocalTime> next_arrival() const;

  /// Puts bytes into the inbox of `to` at once, as if they came from `from`: forgeries and garbage.
  void forge(const Address& from, const Address& to, std::vector<std::byte> datagram);

 private:
  class End;
  struct Flying {
    Address from;
    Address to;
    std::vector<std::byte> datagram;
  };
  void launch(const Address& from, const Address& to, std::span<const std::byte> datagram);

  std::uint64_t seed_;
  injector::Profile to_server_;
  injector::Profile from_server_;
  Address server_;
  LocalTime now_{};
  std::map<Address, std::unique_ptr<End>> ends_;
  std::map<std::pair<Address, Address>, injector::Injector> routes_;
  std::map<std::pair<LocalTime, std::uint64_t>, Flying> flying_;
  std::uint64_t launched_ = 0;
};

/// The whole server and its clients in one thread on a virtual clock: the same HapticLoop, NetworkLoop,
/// Session, Recorder and ForceClient as in production, called in the order of their next wake-up. Nothing
/// sleeps; one seed is one world.
///
/// The server is A, its clients are Z, Y, X …; the network is bad by default.
class World {
 public:
  struct Config {
    std::uint64_t seed = 1;
    HapticLoop::Config loop;
    /// 20 ± 5 ms, 2 % loss each way, unless a test says otherwise.
    injector::Profile to_server = bad();
    injector::Profile from_server = bad();
    /// The operating system wakes the haptic thread this late, uniformly distributed.
    Duration latest_wake{};
    /// … or not at all for `pause`, with this probability per step: a virtual machine.
    double pause_probability = 0;
    Duration pause{};
    std::string scene_text;
    bool record = false;
    /// Steps are taken out as they are made. Datagrams only go to a recording.
    Mailboxes::Capacities mail{.steps = 16, .flight = 2048, .datagrams = 1};
    std::size_t max_observers = 8;

    static injector::Profile bad();
  };

  /// `device` must outlive the world.
  World(const Config& config, Device& device);
  ~World();

  /// A client at an address of its own. Returns a handle for `client` and `kill`.
  std::size_t add_controller(const ForceClient::Config& config, Physics physics);
  std::size_t add_observer(const ForceClient::Config& config, Watch watch);
  ForceClient& client(std::size_t handle) { return *clients_[handle].client; }
  Address client_address(std::size_t handle) const { return clients_[handle].address; }
  /// SIGKILL: it neither says Bye nor anything else, ever again.
  void kill(std::size_t handle);

  /// Called with every haptic step, in order, at once.
  void watch_steps(std::function<void(const StepRecord&)> watch) { watch_steps_ = std::move(watch); }

  void run_for(Duration duration);

  LocalTime now() const { return now_; }
  Network& network() { return network_; }
  const Address& server_address() const { return server_address_; }
  HapticLoop& haptic() { return haptic_; }
  NetworkLoop& server() { return network_loop_; }
  Mailboxes& mail() { return *mail_; }
  const Recorder::Config& recorder_config() const { return recorder_config_; }

  /// Ends the recording and returns its bytes. Only with Config::record.
  const std::vector<std::byte>& finish_recording();

 private:
  struct Client {
    Address address;
    std::unique_ptr<ForceClient> client;  ///< null once killed
    LocalTime due{};
  };
  std::size_t add(const std::function<std::unique_ptr<ForceClient>(Link&, LocalTime)>& make);
  void step_haptic();
  void turn_server();
  void drain_steps();
  void drain_datagrams();
  double uniform();

  Config config_;
  LocalTime now_;
  std::mt19937_64 random_;
  Address server_address_;
  Network network_;
  std::unique_ptr<Mailboxes> mail_;
  HapticLoop haptic_;
  NetworkLoop network_loop_;
  LocalTime haptic_due_;
  LocalTime network_due_;
  LocalTime record_due_;  ///< never, when nobody records
  std::vector<Client> clients_;
  std::function<void(const StepRecord&)> watch_steps_;
  MemorySink sink_;
  Recorder::Config recorder_config_;
  std::optional<Recorder> recorder_;
};

}  // namespace tendon::simulation
