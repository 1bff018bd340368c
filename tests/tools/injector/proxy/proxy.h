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

/// Counts the clients since the proxy started: 0, 1, 2, … in order of their first datagram. Never used again for
/// another client. It is the `link` of the client's injectors and of its lines in a trace.
using ClientIndex = std::uint32_t;

inline constexpr std::size_t kCauses = static_cast<std::size_t>(Cause::kReplay) + 1;

/// What has happened to datagrams in one direction since the start. Each that came in was refused or dropped, has left,
/// was not taken by the kernel, or is still on its way.
struct ProxyCounters {
  std::uint64_t received = 0;                    ///< all that came in
  std::uint64_t refused_clients = 0;             ///< … from clients that could not be added, or were forgotten
  std::uint64_t refused_full = 0;                ///< … beyond Config::max_bytes_in_flight
  std::array<std::uint64_t, kCauses> dropped{};  ///< … that the network made vanish, by Cause
  std::uint64_t forwarded = 0;                   ///< first copies that left
  std::uint64_t duplicated = 0;                  ///< second copies that left
  std::uint64_t replayed = 0;                    ///< stale copies that left
  std::uint64_t flipped = 0;                     ///< of those forwarded: with a bit flipped
  std::uint64_t truncated = 0;                   ///< … cut
  std::uint64_t unsent = 0;                      ///< copies of all kinds that the kernel did not take

  std::uint64_t lost() const noexcept;  ///< Σ dropped
};

/// What one direction of the proxy did.
struct ProxyMeasurements {
  ProxyCounters counters;
  DurationHistogram delay;          ///< of first copies: when they left − when they arrived, the truth of the run
  DurationHistogram release_error;  ///< of all copies: when they left − when they were due
};

/// A bad network between many clients and one server, without sockets and without a clock: datagrams go in with the
/// time of their arrival, and come out when they are due. Each client and direction has a Decider of its own, so that
/// what one client sends does not change what happens to another.
///
/// The driver owns one socket that clients send to, and one more for each client, connected to the server, on which the
/// server's answers to that client come in.
///
/// Thread-safe: no.
class Proxy {
 public:
  /// Another network from now on, made ready where there is time for it: building an injector's tables takes up to
  /// milliseconds.
  struct PreparedChange {
    std::optional<ClientIndex> client;          ///< none: all clients, those to come as well
    std::array<std::optional<Injector>, 2> to;  ///< by Direction; none: stays as it is
    std::string text;                           ///< what people call it
  };
  struct Step {
    Duration at{};  ///< after the first datagram
    PreparedChange change;
  };

  static constexpr Duration kIdleTimeout = std::chrono::seconds(30);

  struct Config {
    /// By Direction: every client gets the same network, with draws of its own (Injector::for_link).
    std::array<Injector, 2> networks;

    /// In the order of their times.
    std::vector<Step> timeline = {};

    /// When given, recorded decisions instead of all that. Must outlive the proxy.
    const Trace* replay = nullptr;
    TracePlayer::By replay_by = TracePlayer::By::kIndex;

    /// Keep a TraceRecord of every decision, see records().
    bool record = false;

    /// Clients at one time; datagrams of further ones are refused. Each costs the driver a socket.
    std::size_t max_clients = 64;

    /// The proxy forgets a client that has been silent for this long, once none of its datagrams are in flight. NATs keep
    /// a UDP mapping for 30 s or more (RFC 4787 recommends 120 s), so a client has to expect this.
    Duration idle_timeout = kIdleTimeout;

    /// What may be on its way at one time, payload and bookkeeping; datagrams beyond are refused.
    std::size_t max_bytes_in_flight = Flight<int>::kDefaultMaxBytes;
  };

  /// Throws std::invalid_argument as TracePlayer does.
  explicit Proxy(Config config);

  /// Returns true if a datagram from this address would add a client.
  bool is_new(const Address& client) const;

  /// Takes a datagram from a client to the server. Returns the index of the client, or nothing if the datagram was refused
  /// because there are too many clients or `may_add` is false.
  std::optional<ClientIndex> receive_from_client(const Address& client, std::span<const std::byte> datagram,
                                                 LocalTime arrival, bool may_add = true);

  /// A datagram that came in on the socket of `client`.
  void receive_from_server(ClientIndex client, std::span<const std::byte> datagram, LocalTime arrival);

  struct Departure {
    Address to;       ///< the client; the server is not known here
    LocalTime due{};  ///< when it should leave
    Copy copy{};
    std::span<const std::byte> datagram;  ///< valid until the next datagram is received
    TraceRecord record;                   ///< direction, link and decision
  };
  /// Takes out the next datagram that is due at `now`, in order of due times and, for equal ones, of arrival; empty
  /// when there is none. What became of it must be told to `left` or `not_sent`.
  std::optional<Departure> next_due(LocalTime now);

  /// The kernel took it at `now`.
  void left(const Departure& departure, LocalTime now);
  /// The kernel did not take it.
  void not_sent(const Departure& departure);

  /// Nothing changes while a trace is replayed.
  void change(const PreparedChange& change, LocalTime now);

  /// Makes the changes of the timeline that are due. Needed only to see them in time: every datagram meets those that
  /// were due at its arrival.
  void follow_timeline(LocalTime now);

  /// Forgets one idle client and names it, so that the driver can close its socket; empty when there is none (any
  /// more).
  std::optional<ClientIndex> next_evicted(LocalTime now);

  /// When next_due or next_evicted will have something again; empty when nothing is on its way and there is no client.
  std::optional<LocalTime> next_wake() const;

  /// Of the decisions that were completed since this was emptied last, for whoever writes them down and empties it:
  /// those on datagrams that were dropped when they were, the others when the datagram has left. Times count from the
  /// first datagram. The proxy forgets what nobody fetches only when Config::record is off.
  std::vector<TraceRecord>& records() noexcept { return records_; }

  const ProxyMeasurements& measurements(Direction direction) const { return measurements_[index_of(direction)]; }
  /// The last change, as people call it; empty when there was none.
  const std::string& last_change() const noexcept { return last_change_; }
  /// Steps of the timeline that are behind us.
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
    Injector* injector = nullptr;      // the decider, unless a trace is replayed
    std::unique_ptr<History> history;  // where stale replays are possible
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
    Client* client = nullptr;  // stays: no client is forgotten while something is on its way
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
  std::optional<LocalTime> start_;  // the first datagram
  struct Network {
    Injector injector;
    LocalTime since;  // from when its times count
  };
  std::array<std::optional<LocalTime>, 2> changed_;              // when config_.networks were, by Direction
  std::array<std::map<ClientIndex, Network>, 2> of_one_client_;  // where it is not that of all, by Direction
  std::string last_change_;
  std::size_t steps_done_ = 0;
  std::unordered_map<ClientIndex, std::unique_ptr<Client>> clients_;
  std::unordered_map<Address, Client*, AddressHash> by_address_;
  ClientIndex next_index_ = 0;
  Flight<Tag> flight_;
  std::array<ProxyMeasurements, 2> measurements_;  // by Direction
  std::vector<TraceRecord> records_;
};

}  // namespace tendon::injector
