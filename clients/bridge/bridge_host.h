// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/bridge/bridged_device.h"
#include "clients/cpp/server_name.h"
#include "clients/cpp/udp_transport.h"
#include "server/machine/output.h"

namespace tendon::bridge {

struct BridgeConfig {
  ServerName server = "127.0.0.1:47100";
  ForceClient::Config client{};        ///< `device` and `seed` are set for each BridgedDevice
  std::vector<std::string> devices{};  ///< device names; empty: the first device of the server, named "device"
  bool observe = false;
  bool always_observe = false;  ///< see BridgedDevice::Config
  bool json = false;            ///< print one line per second to stdout
};

/// All devices of a bridge with their sockets, for use in the main loop of the bridge.
///
///     BridgeHost host(config, read_clock());
///     for (LocalTime now = read_clock(); !stop; now = read_clock()) {
///       const LocalTime next = host.turn(now);
///       … serve the programs: host.device(0).state(), host.device(0).ask(…); if a force was requested: host.turn(now)
///       host.wait(sockets_of_the_programs, now, next);
///     }
///
/// The name of the server is resolved again between two attempts. The host prints each change to stderr:
/// "tendon-bridge: right: connected to …". With `json`, it prints one line per second for each device:
///
///     {"device":"right","states":1000,"forces":998,"dropped":0,"unusable":0,"owner":1,"pushes":true,
///      "round_trip_ms":0.4, …}                     totals since the start, followed by the counts of the bridge
///
/// Thread-safe: no. Realtime-safe: no.
class BridgeHost {
 public:
  using Count = std::pair<std::string_view, std::uint64_t>;  ///< name and value, for the JSON lines

  BridgeHost(BridgeConfig config, LocalTime now);  ///< throws std::runtime_error if a socket cannot be opened

  std::size_t size() const noexcept { return served_.size(); }
  BridgedDevice& device(std::size_t i) { return served_[i].bridged; }
  const std::string& name(std::size_t i) const { return served_[i].name; }

  /// Turns every BridgedDevice and returns the time of the next turn. `counts` are added to the JSON lines.
  LocalTime turn(LocalTime now, std::span<const Count> counts = {});

  void say(const std::string& sentence) const;  ///< prints a message to stderr, "tendon-bridge: …"

  /// Sleeps until a server socket or one of `others` is ready or until `until`, at most 100 ms so that signals are
  /// noticed. Sets `revents` of `others`.
  void wait(std::span<pollfd> others, LocalTime now, LocalTime until);
  /// Sockets of the server, for bridges with their own event loop. Read the list again after each name lookup.
  std::vector<int> descriptors() const;

  /// Sends a Bye for each device. Returns the exit code, which is 1 (with a message) if a device never sent a state.
  int stop(LocalTime now);

 private:
  struct Served {
    Served(const BridgeConfig& config, const std::string& device, LocalTime now);
    std::string name;
    UdpTransport watcher;
    UdpTransport controller;
    BridgedDevice bridged;
    ForceClient::Phase phase = ForceClient::Phase::kGreeting;
  };

  void look_up_again(Served& served);
  void write_line(std::span<const Count> counts);

  UnblockedOutput output_;
  BridgeConfig config_;
  std::deque<Served> served_;
  std::vector<pollfd> polled_;
  LocalTime next_line_{};
};

}  // namespace tendon::bridge
