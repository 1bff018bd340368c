// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/proxy/duration_histogram.h"
#include "tests/tools/injector/proxy/flight.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::injector {

/// Clients are numbered from 0 by their first datagram; no index is reused. It is the `link` of injectors and traces.
using ClientIndex = std::uint32_t;

inline constexpr std::size_t kCauses = static_cast<std::size_t>(Cause::kReplay) + 1;

/// Datagrams of one direction: each received one is refused, ignored, dropped, forwarded, unsent or still in flight.
struct ProxyCounters {
  std::uint64_t received = 0;
  std::uint64_t refused_clients = 0;             ///< from clients that could not be added or have been forgotten
  std::uint64_t refused_full = 0;                ///< exceeded Config::max_bytes_in_flight
  std::array<std::uint64_t, kCauses> dropped{};  ///< by the network, by Cause
  std::uint64_t forwarded = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t replayed = 0;
  std::uint64_t flipped = 0;    ///< forwarded with a flipped bit
  std::uint64_t truncated = 0;  ///< forwarded truncated
  std::uint64_t unsent = 0;     ///< copies of all kinds that the kernel refused
  std::uint64_t after_end = 0;  ///< ignored, because they arrived when the trace had ended (AtEnd::kStop)

  std::uint64_t lost() const noexcept;
};

struct ProxyMeasurements {
  ProxyCounters counters;
  DurationHistogram delay;          ///< first copies: departure − arrival, the actual one-way delay
  DurationHistogram release_error;  ///< all copies: departure − due time
  double played = 0;                ///< the maximum of TracePlayer::played() over the clients
};

/// Simulates a bad network between multiple clients and a server. This class does not use sockets or a clock. Datagrams
/// enter with their arrival time and leave when they are due. Each client and direction has its own Decider, so that
/// the traffic of one client does not affect another.
///
/// The driver owns one socket for clients and, for each client, one socket connected to the server, which receives the
/// server's answers to that client.
///
/// Thread-safe: no.
class Proxy {
 public:
  /// A change of the network with its tables already built, which takes up to a few milliseconds.
  struct PreparedChange {
    std::optional<ClientIndex> client;          ///< none: all present and future clients
    std::array<std::optional<Injector>, 2> to;  ///< by Direction; none: unchanged
    std::string text;
  };
  struct Step {
    Duration at{};  ///< after the first datagram
    PreparedChange change;
  };

  static constexpr Duration kIdleTimeout = std::chrono::seconds(30);

  struct Config {
    /// By Direction. Every client gets the same network with its own draws (Injector::for_link).
    std::array<Injector, 2> networks;

    std::vector<Step> timeline = {};

    /// Replayed instead of `timeline`, and of `networks` unless they are added. Must outlive the proxy.
    const Trace* replay = nullptr;
    Playback playback = {};

    bool record = false;

    /// Datagrams from additional clients are ignored.
    std::size_t max_clients = 64;

    /// Forgets a client after this silence, once none of its datagrams are in flight. NATs keep a UDP mapping for 30 s
    /// or more (RFC 4787 recommends 120 s), so clients have to expect this.
    Duration idle_timeout = kIdleTimeout;

    /// Limit for payload and bookkeeping; datagrams beyond it are refused.
    std::size_t max_bytes_in_flight = Flight<int>::kDefaultMaxBytes;
  };

  /// Throws std::invalid_argument if TracePlayer does.
  explicit Proxy(Config config);

  bool is_new(const Address& client) const;

  /// Returns nothing if the datagram was refused because there are too many clients or `may_add` is false.
  std::optional<ClientIndex> receive_from_client(const Address& client, std::span<const std::byte> datagram,
                                                 LocalTime arrival, bool may_add = true);

  void receive_from_server(ClientIndex client, std::span<const std::byte> datagram, LocalTime arrival);

  struct Departure {
    Address to;  ///< the client; unused toward the server
    LocalTime due{};
    Copy copy{};
    std::span<const std::byte> datagram;  ///< valid until the next datagram is received
    TraceRecord record;
  };
  /// The next datagram due at `now`, by due time and then arrival. Report the result to `left` or `not_sent`.
  std::optional<Departure> next_due(LocalTime now);

  void left(const Departure& departure, LocalTime now);
  void not_sent(const Departure& departure);

  /// Has no effect while a trace is replayed.
  void change(const PreparedChange& change, LocalTime now);

  /// Applies the due changes of the timeline, only for timely display: each datagram meets those due at its arrival.
  void follow_timeline(LocalTime now);

  /// Returns true after the end of a trace with AtEnd::kStop. Then, the proxy ignores new datagrams, but releases those
  /// in flight.
  bool ended() const noexcept { return ended_; }

  /// Forgets one idle client, so that the driver can close its socket.
  std::optional<ClientIndex> next_evicted(LocalTime now);

  /// When next_due or next_evicted next has a result; nullopt if nothing is in flight and there are no clients.
  std::optional<LocalTime> next_wake() const;

  /// Decisions since the caller last cleared this vector, if Config::record is set. A dropped datagram's is complete on
  /// arrival, others on departure. Times are relative to the first datagram.
  std::vector<TraceRecord>& records() noexcept { return records_; }

  const ProxyMeasurements& measurements(Direction direction) const { return measurements_[index_of(direction)]; }
  const std::string& last_change() const noexcept { return last_change_; }
  std::size_t steps_done() const noexcept { return steps_done_; }
  struct ClientSummary {
    ClientIndex index;
    Address address;
    std::array<std::uint64_t, 2> received;  ///< by Direction
  };
  std::vector<ClientSummary> clients() const;
  std::size_t in_flight() const noexcept { return flight_.size(); }

 private:
  struct Way {
    std::unique_ptr<Decider> decider;
    Injector* injector = nullptr;      // the decider, or null if a trace is replayed
    TracePlayer* player = nullptr;     // the decider, or null
    std::unique_ptr<History> history;  // only if the network has stale replays
    std::uint64_t received = 0;
  };
  struct Client {
    ClientIndex index = 0;
    Address address;
    LocalTime last_heard;
    std::size_t in_flight = 0;
    std::array<Way, 2> ways;  // by Direction
  };
  struct Tag {
    Client* client = nullptr;  // stable: a client with datagrams in flight is not forgotten
    TraceRecord record;
  };
  struct AddressHash {
    std::size_t operator()(const Address& address) const noexcept;
  };

  static std::size_t index_of(Direction direction) noexcept { return static_cast<std::size_t>(direction); }
  ProxyCounters& count(Direction direction) noexcept { return measurements_[index_of(direction)].counters; }
  Client& add_client(const Address& address);
  void inject(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime arrival);
  void complete(TraceRecord record);

  Config config_;
  std::optional<LocalTime> start_;
  struct Network {
    Injector injector;
    LocalTime since;  // origin of its times
  };
  std::array<std::optional<LocalTime>, 2> changed_;              // when config_.networks last changed, by Direction
  std::array<std::map<ClientIndex, Network>, 2> of_one_client_;  // networks that differ from config_.networks, by
  std::string last_change_;
  std::size_t steps_done_ = 0;
  bool ended_ = false;
  std::unordered_map<ClientIndex, std::unique_ptr<Client>> clients_;
  std::unordered_map<Address, Client*, AddressHash> by_address_;
  ClientIndex next_index_ = 0;
  Flight<Tag> flight_;
  std::array<ProxyMeasurements, 2> measurements_;  // by Direction
  std::vector<TraceRecord> records_;
};

}  // namespace tendon::injector
