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

inline constexpr std::uint16_t kFirstClientPort = 50000;

class CustomClient {
 public:
  virtual ~CustomClient() = default;
  /// Runs everything that is due at `now` and returns when it must be called again, in the peer's clock.
  virtual LocalTime turn(LocalTime now) = 0;
};

/// Production's Assembly, Session, Recorder and ForceClient in one thread on a virtual clock, called in the order of
/// their next wake-up. The result only depends on the seed. The server is A, its clients are Z, Y, X …; the network is
/// bad by default.
class World {
 public:
  struct Config {
    std::uint64_t seed = 1;
    HapticLoop::Config loop;
    /// The default is 20 ± 5 ms and 2 % loss in each direction.
    Network::Weather weather = bad();
    Network::Players players{};
    /// Uniformly distributed.
    Duration latest_wake{};
    /// Per step: the haptic thread is suspended for `pause`, as in a virtual machine.
    double pause_probability = 0;
    Duration pause{};
    std::string scene_text;
    bool record = false;
    Mailboxes::Capacities mail{.steps = 16, .flight = 2048, .datagrams = 1};
    std::size_t max_observers = 8;
    bool adapt_state_rate = false;
    std::vector<ClientKey> keys{};  ///< If this is empty, all clients are accepted, with suite 0.
    /// For the server and the clients with a key. Suite 2 requires a processor with AES; worlds of suite 1 are
    /// identical on all processors.
    Suites suites = {Suite::kNoise};
    Rekey rekey{};
    Duration session_life = Session::Config{}.life;

    static Network::Weather bad();
  };

  /// `device` must outlive the world.
  World(const Config& config, Device& device);
  ~World();

  /// Adds a client with its own address and clock. Returns a handle for `client` and `kill`; clients count from 0.
  std::size_t add_controller(const ForceClient::Config& config, Physics physics,
                             const injector::DriftingClock& clock = {});
  std::size_t add_observer(const ForceClient::Config& config, Watch watch, const injector::DriftingClock& clock = {});
  std::size_t add_custom_client(
      const std::function<std::unique_ptr<CustomClient>(Link& link, const Address& server)>& make);
  void restart_controller(std::size_t handle, const ForceClient::Config& config, Physics physics);
  void restart_observer(std::size_t handle, const ForceClient::Config& config, Watch watch);
  bool alive(std::size_t handle) const { return clients_[handle].client != nullptr; }
  ForceClient& client(std::size_t handle) { return *clients_[handle].client; }
  Address client_address(std::size_t handle) const { return clients_[handle].address; }
  const injector::DriftingClock& clock(std::size_t handle) const { return clients_[handle].clock; }
  /// As SIGKILL: no Bye.
  void kill(std::size_t handle);
  void stop(std::size_t handle);

  /// Called synchronously with every haptic step, in order.
  void watch_steps(std::function<void(const StepRecord&)> watch) { watch_steps_ = std::move(watch); }

  struct Turn {
    std::optional<std::size_t> client;  ///< empty: the server
    bool wants_more = false;            ///< must be called again immediately
  };
  void watch_turns(std::function<void(const Turn&)> watch) { watch_turns_ = std::move(watch); }

  /// Throws std::runtime_error if a peer keeps asking to be called again.
  void run_for(Duration duration);

  LocalTime now() const { return now_; }
  Network& network() { return network_; }
  const Address& server_address() const { return server_address_; }
  HapticLoop& haptic() { return assembly_.devices().front().haptic; }
  NetworkLoop& server() { return assembly_.network(); }
  Mailboxes& mail() { return assembly_.devices().front().mail; }
  const Recorder::Config& recorder_config() const { return recorder_config_; }

  const std::vector<std::byte>& finish_recording();

 private:
  struct Client {
    Address address;
    Link* link = nullptr;
    injector::DriftingClock clock;
    std::unique_ptr<ForceClient> client;  ///< null once killed
    std::unique_ptr<CustomClient> custom;
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
