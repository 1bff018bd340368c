// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/time.h"
#include "protocol/link.h"
#include "tests/injector/injector.h"

namespace tendon::injector {

/// Counts the clients since the proxy started: 0, 1, 2, … in order of their first datagram. Never
/// used again for another client. It is the link of the client's injectors.
using ClientIndex = std::uint32_t;

struct ProxyOptions {
  Address server;
  Profile up;
  Profile down;
  std::uint64_t seed = 0;

  /// Clients at one time; datagrams of further ones are refused. Each costs the driver a socket, and
  /// the server serves one controller and a handful of observers.
  std::size_t max_clients = 64;

  /// A client that says nothing for this long is forgotten, once nothing is on its way any more.
  /// Well beyond the 10 s after which the server ends a session, so no living session loses its route.
  Duration idle_timeout = std::chrono::seconds(30);

  /// What may be on its way at one time, payload and bookkeeping; datagrams beyond are refused.
  /// The longest delay (60 s) at 1 kHz in both directions with 400-byte datagrams fits.
  std::size_t max_bytes_in_flight = std::size_t{64} << 20;
};

/// What has happened to datagrams in one direction since the start.
struct ProxyCounters {
  std::uint64_t received = 0;    ///< all that came in
  std::uint64_t refused = 0;     ///< … but were beyond a limit of ProxyOptions, or not from the server
  std::uint64_t lost = 0;        ///< … and that the profile made vanish
  std::uint64_t forwarded = 0;   ///< first copies handed out by next_due
  std::uint64_t duplicated = 0;  ///< second copies handed out by next_due
};

/// A bad network between many clients and one server, without sockets and without a clock: datagrams
/// go in with the time of their arrival, and come out when they are due. Each client and direction
/// has an Injector of its own (the link is the client's index), so that what one client sends does not
/// change what happens to another.
///
/// The driver owns one socket that clients send to, and one more for each client, from which the
/// server receives that client's datagrams (it tells its peers apart by address).
///
/// Thread-safe: no.
class Proxy {
 public:
  /// Throws std::invalid_argument as check() does, naming the direction as well.
  explicit Proxy(const ProxyOptions& options);

  /// A datagram from a client to the server. The client's index, so that the driver can open a
  /// socket for a new one; empty when the datagram was refused because there are too many clients.
  std::optional<ClientIndex> receive_from_client(const Address& client, std::span<const std::byte> datagram,
                                                 LocalTime now);

  /// A datagram that came in on the socket of `client`. Only the server's are taken.
  void receive_from_server(ClientIndex client, const Address& from, std::span<const std::byte> datagram, LocalTime now);

  struct Departure {
    Direction direction{};
    ClientIndex client = 0;
    Address to;       ///< the server, or the client
    LocalTime due{};  ///< when it should have left
    std::vector<std::byte> datagram;
  };
  /// Takes out the next datagram that is due at `now`, in order of due times and, for equal ones, of
  /// arrival; empty when there is none.
  std::optional<Departure> next_due(LocalTime now);

  /// Forgets one idle client and names it, so that the driver can close its socket; empty when there
  /// is none (any more).
  std::optional<ClientIndex> next_evicted(LocalTime now);

  /// When next_due or next_evicted will have something again; empty when nothing is on its way and
  /// there is no client.
  std::optional<LocalTime> next_wake() const;

  const ProxyCounters& counters(Direction direction) const { return counters_[static_cast<std::size_t>(direction)]; }
  std::size_t clients() const { return clients_.size(); }
  std::size_t in_flight() const { return in_flight_.size(); }

 private:
  struct Client {
    ClientIndex index;
    Address address;
    LocalTime last_heard;
    std::size_t in_flight = 0;
    std::array<Injector, 2> injectors;  // by Direction
  };
  struct Flying {
    Direction direction{};
    ClientIndex client = 0;
    bool second_copy = false;
    std::vector<std::byte> datagram;
  };

  Client* find(ClientIndex index);
  void inject(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime now);
  void take_off(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime due,
                bool second_copy);
  ProxyCounters& count(Direction direction) { return counters_[static_cast<std::size_t>(direction)]; }

  ProxyOptions options_;
  std::array<Injector, 2> prototypes_;  // by Direction
  std::vector<Client> clients_;         // at most max_clients: searched one by one
  ClientIndex next_index_ = 0;
  std::map<std::pair<LocalTime, std::uint64_t>, Flying> in_flight_;  // by due time, then by order of arrival
  std::uint64_t next_sequence_ = 0;
  std::size_t bytes_in_flight_ = 0;
  std::array<ProxyCounters, 2> counters_{};  // by Direction
};

}  // namespace tendon::injector
