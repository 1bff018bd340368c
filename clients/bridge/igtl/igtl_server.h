// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clients/bridge/alias.h"
#include "clients/bridge/bridge_loop.h"
#include "clients/bridge/igtl/igtl_session.h"
#include "clients/bridge/sockets.h"

namespace tendon::bridge::igtl {

/// An OpenIGTLink server for run_bridge(). It creates a Session for each program that connects.
///
/// * **Limits.** The server accepts kMaxClients programs, and closes all other connections. It reads at most kMaxRead
///   bytes from a program per kRest, so that a flood or an image does not delay the other programs.
/// * **Ends.** If a connection ends, the server releases the devices of the program, and the last force is faded.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class Server {
 public:
  static constexpr std::size_t kMaxClients = 16;
  static constexpr std::size_t kMaxRead = 16 * 1024;
  static constexpr Duration kRest = std::chrono::milliseconds(1);

  struct Config {
    Address listen;  ///< IPv4; port 0: any
    std::vector<Alias> names;
    Station::Config station;  ///< for all names; `name` is replaced
  };

  Server(BridgeHost& host, Config config);  ///< throws std::runtime_error if the address cannot be used
  ~Server();

  const Address& address() const noexcept { return address_; }

  LocalTime turn(const Moment& now);
  std::span<pollfd> polled() { return polled_; }
  std::span<const BridgeHost::Count> counts();

 private:
  struct Client {
    Client(std::span<const Station> stations, Descriptor socket, const Address& from, std::uint32_t its_number)
        : tcp(std::move(socket)),
          number(its_number),
          name("program " + std::to_string(its_number) + " (" + to_string(from) + ")"),
          session(its_number, stations) {}
    Descriptor tcp;
    std::uint32_t number;
    std::string name;
    Session session;
    LocalTime rests_until{};
    std::string over;
  };

  void take_connections();
  void read(LocalTime now, Client& client);
  static void write(Client& client);
  void drop(Client& client);
  void poll_again(LocalTime now);

  BridgeHost& host_;
  Config config_;
  Descriptor tcp_;
  Address address_;
  std::vector<Station> stations_;
  std::deque<std::unique_ptr<Client>> clients_;
  std::uint32_t last_number_ = 0;
  bool full_said_ = false;
  Session::Counts gone_;
  std::array<BridgeHost::Count, 5> counts_;
  std::vector<pollfd> polled_;
  Buffer buffer_;
};

}  // namespace tendon::bridge::igtl
