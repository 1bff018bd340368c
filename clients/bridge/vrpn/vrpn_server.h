// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/bridge/alias.h"
#include "clients/bridge/bridge_host.h"
#include "clients/bridge/sockets.h"
#include "clients/bridge/vrpn/vrpn_peer.h"

namespace tendon::bridge::vrpn {

/// The sockets of a VRPN server: one port for TCP and UDP.
///
///     Server server(host, config, now);
///     for (…) host.turn(now, server.counts()); next = server.turn(moment); host.wait(server.polled(), now, next);
///
/// * **Connections.** A program sends a datagram with its TCP port, and the server connects to that port *at the source
///   address of the datagram*; or the program opens a TCP connection. Addresses in the text of the datagram or in the
///   description of a UDP port are never used. Connecting is asynchronous, limited to kDialsPerSecond and to one
///   connection per port, and is given up after kPatience.
/// * **Limits.** At most kMaxClients, including those being connected. Further connections are closed, and a message is
///   printed for the first of them. A client that sends no cookie within kPatience is closed.
/// * **Forces.** Each program has an Asker for each station. At the end of the connection, the Asker releases the
///   devices, and the server fades the last force.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class Server {
 public:
  static constexpr std::size_t kMaxClients = 16;
  static constexpr int kDialsPerSecond = 20;
  static constexpr Duration kPatience = std::chrono::seconds(3);

  struct Config {
    Address listen;  ///< IPv4; port 0: any
    std::vector<Alias> names;
  };

  Server(BridgeHost& host, Config config, LocalTime now);  ///< throws std::runtime_error "cannot listen at …: …"
  ~Server();

  const Address& address() const noexcept { return address_; }

  /// Serves all clients; must be called after BridgeHost::turn and BridgeHost::wait. Returns the time of the next turn,
  /// or `now` if a requested force should be sent immediately.
  LocalTime turn(const Moment& now);
  std::span<pollfd> polled() { return polled_; }  ///< arguments for BridgeHost::wait; valid until the next turn
  std::span<const BridgeHost::Count> counts();

 private:
  struct Client;

  void serve_states(const Moment& now);
  void take_hello(const Moment& now);
  void dial(const Moment& now, const Address& to);
  void take_connections(const Moment& now);
  bool has_place(const std::string& whom);
  void read(const Moment& now, Client& client, short ready, short datagrams_ready);
  void finish_dial(const Moment& now, Client& client, short ready);
  void open_udp(const Moment& now, Client& client);
  void write(Client& client);
  void drop(Client& client, const std::string& why);
  void poll_again(LocalTime now);

  BridgeHost& host_;
  Config config_;
  Address address_;
  Descriptor tcp_;
  Descriptor udp_;
  std::vector<Station> stations_;
  struct Seen {
    std::uint64_t states = 0;
    bool lost = false;
  };
  std::vector<Seen> seen_;
  std::deque<std::unique_ptr<Client>> clients_;
  std::uint32_t last_number_ = 0;
  bool full_said_ = false;
  double dials_ = kDialsPerSecond;
  LocalTime dialled_{};
  Peer::Counts gone_;
  std::vector<BridgeHost::Count> counts_;
  std::vector<pollfd> polled_;
  Buffer buffer_;
};

}  // namespace tendon::bridge::vrpn
