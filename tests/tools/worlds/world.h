// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "clients/cpp/force_client.h"
#include "devices/device.h"
#include "protocol/link.h"
#include "server/assembly.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/traces/peer_clock.h"
#include "tests/tools/worlds/network.h"

namespace tendon::simulation {

/// Port of the first client of a world; the others follow.
inline constexpr std::uint16_t kFirstClientPort = 50000;

/// A peer that is none of ours: what it does is its own business.
class Guest {
 public:
  virtual ~Guest() = default;
  /// Does all there is to do at `now`, by its own clock, and returns when it wants to be called again at the latest.
  virtual LocalTime turn(LocalTime now) = 0;
};

/// The whole server and its clients in one thread on a virtual clock: the same Assembly, Session, Recorder and
/// ForceClient as in production, called in the order of their next wake-up. Nothing sleeps; one seed is one world.
///
/// The server is A, its clients are Z, Y, X …; the network is bad by default.
class World {
 public:
  struct Config {
    std::uint64_t seed = 1;
    HapticLoop::Config loop;
    /// 20 ± 5 ms, 2 % loss each way, unless a test says otherwise.
    Network::Weather weather = bad();
    /// A recorded network instead of the weather.
    Network::Players players{};
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
    bool adapt_state_rate = false;
    std::vector<ClientKey> keys{};  ///< of those who may come in; empty: everybody, by suite 0
    /// Of the server and of the clients that have a key. Suite 2 takes a processor with AES; a world of suite 1 is the
    /// same on all.
    Suites suites = {Suite::kNoise};
    Rekey rekey{};                                   ///< of what the server says
    Duration session_life = Session::Config{}.life;  ///< by the server

    static Network::Weather bad();
  };

  /// `device` must outlive the world.
  World(const Config& config, Device& device);
  ~World();

  /// A client at an address of its own, which reads a clock of its own. Returns a handle for `client` and `kill`;
  /// clients count from 0.
  std::size_t add_controller(const ForceClient::Config& config, Physics physics,
                             const injector::DriftingClock& clock = {});
  std::size_t add_observer(const ForceClient::Config& config, Watch watch, const injector::DriftingClock& clock = {});
  std::size_t add_guest(const std::function<std::unique_ptr<Guest>(Link& link, const Address& server)>& make);
  /// In place of a client that has gone: at the same address, with the same clock.
  void restart_controller(std::size_t handle, const ForceClient::Config& config, Physics physics);
  void restart_observer(std::size_t handle, const ForceClient::Config& config, Watch watch);
  bool alive(std::size_t handle) const { return clients_[handle].client != nullptr; }
  ForceClient& client(std::size_t handle) { return *clients_[handle].client; }
  Address client_address(std::size_t handle) const { return clients_[handle].address; }
  const injector::DriftingClock& clock(std::size_t handle) const { return clients_[handle].clock; }
  /// SIGKILL: it neither says Bye nor anything else, ever again.
  void kill(std::size_t handle);
  /// It says Bye, and is gone. Clients only.
  void stop(std::size_t handle);

  /// Called with every haptic step, in order, at once.
  void watch_steps(std::function<void(const StepRecord&)> watch) { watch_steps_ = std::move(watch); }

  /// A turn of the server, or of a client.
  struct Turn {
    std::optional<std::size_t> client;  ///< empty: the server's
    bool wants_more = false;            ///< it wants to be called again at once
  };
  /// Called after every turn.
  void watch_turns(std::function<void(const Turn&)> watch) { watch_turns_ = std::move(watch); }

  /// Throws std::runtime_error when somebody wants to be called again and again without an end.
  void run_for(Duration duration);

  LocalTime now() const { return now_; }
  Network& network() { return network_; }
  const Address& server_address() const { return server_address_; }
  HapticLoop& haptic() { return assembly_.devices().front().haptic; }
  NetworkLoop& server() { return assembly_.network(); }
  Mailboxes& mail() { return assembly_.devices().front().mail; }
  const Recorder::Config& recorder_config() const { return recorder_config_; }

  /// Ends the recording and returns its bytes. Only with Config::record.
  const std::vector<std::byte>& finish_recording();

 private:
  struct Client {
    Address address;
    Link* link = nullptr;
    injector::DriftingClock clock;
    std::unique_ptr<ForceClient> client;  ///< null once killed
    std::unique_ptr<Guest> guest;
    LocalTime due{};
  };
  Client& place(const injector::DriftingClock& clock);
  template <class Callback>
  void restart(std::size_t handle, const ForceClient::Config& config, Callback callback);
  void turn_client(std::size_t handle);
  void step_haptic();
  void turn_server();
  void turn_log();
  void drain_steps();
  void drain_datagrams();
  double uniform();

  Config config_;
  LocalTime now_;
  std::mt19937_64 random_;
  Address server_address_;
  Network network_;
  Assembly assembly_;
  LocalTime haptic_due_;
  LocalTime network_due_;
  LocalTime log_due_;
  std::vector<Client> clients_;
  std::function<void(const StepRecord&)> watch_steps_;
  std::function<void(const Turn&)> watch_turns_;
  MemorySink sink_;
  Recorder::Config recorder_config_;
  std::optional<Recorder> recorder_;
};

}  // namespace tendon::simulation
