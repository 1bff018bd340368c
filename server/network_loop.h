// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/session.h"
#include "server/guests/admission.h"
#include "server/guests/guest.h"
#include "server/guests/leases.h"
#include "server/guests/port_exchange.h"
#include "server/guests/reports.h"
#include "server/mailboxes.h"
#include "server/network_stats.h"
#include "server/recording/datagram_sieve.h"

namespace tendon {

/// One half of the server: lets guests in, hands their forces to the haptic loops, and the devices' states to the
/// guests.
///
/// One thread calls `turn` when a datagram has come, when a haptic loop has made a step, or when the time that the last
/// turn returned has come. That thread does nothing else, except wait and read the clock.
///
/// Each channel takes the forces of one controller; with a lease, several controllers may share it in turn
/// (SESSION.md). There are up to `max_observers` observers. Those that ask for it (kFeatureDiagnostics) are told once a
/// second how the devices' loops and the engines do. Each turn drains the link, so that nothing new waits behind
/// something old. Of forces the newest wins; every request is answered.
///
/// Several loops may share the devices of a large server (Shard), each with a thread and a link of its own. They share
/// nothing else. One of them gets a Hello; when it is for devices of another one, the owner of both carries it there
/// (take_foreign, receive_foreign).
///
/// Without keys, guests speak in the clear, from this machine only. With keys all is sealed, by `suites`, except through
/// a Unix socket, where the permission to write to its file is the key. A guest is half-open until its first authentic
/// Data, and until then nothing changes for anybody else. Its address is the one its newest authentic datagram came
/// from. A controller that comes again with its key takes its own place.
///
/// The files of guests/ decide: who comes in (admission.h), who holds which channel (leases.h), what a request does
/// (requests.h), why a force is late (lateness.h), what is told once a second (reports.h). This class moves datagrams,
/// and lets them act on its guests.
///
/// Thread-safe: no. Realtime-safe: no.
class NetworkLoop {
 public:
  struct Config {
    Bytes32 secret{};               ///< of cookies and ephemeral keys; random at start; of all shards the same
    std::vector<ClientKey> keys{};  ///< who may come in; empty: anybody on this machine, in the clear
    Suites suites = suites_of_this_machine();  ///< by which the sessions of those may be sealed
    /// Whether the system has made sure who speaks from an address (UnixSocket::is_peer): a guest there needs no key.
    /// Null: none.
    bool (*needs_no_key)(const Address& from) noexcept = nullptr;
    Shard shard{};                          ///< `devices` contains the devices of all shards
    std::uint32_t first_connection_id = 1;  ///< random at start, so that a restarted server does not know old guests
    std::string server_name = "tendond";
    std::vector<ServedDevice::Config> devices{};  ///< at most kMostDevices
    /// Clients that need not wait for the end of a lease: the names of their keys, without keys their own.
    std::vector<std::string> takeover{};
    /// Each costs this loop's thread a state datagram of some 250 bytes per haptic step. Where there are several keys,
    /// one key has at most half of these places, rounded up.
    std::size_t max_observers = 8;
    Duration controller_timeout = std::chrono::seconds(2);
    Duration observer_timeout = std::chrono::seconds(10);
    /// Most handshakes answered and not yet confirmed by an authentic datagram: anybody can replay a Hello. 16 are more
    /// than start within a round trip; the oldest gives way.
    std::size_t max_half_open = 16;
    Duration half_open_timeout = std::chrono::seconds(5);
    Rekey rekey{};  ///< of sealed sessions, as their `life`
    Duration session_life = Session::Config{}.life;
    /// Sends fewer states to a guest whose link is full (RateAdaptation). Where even the lowest rate loses a tenth,
    /// forces are not handed on, and the device comes to its safe stop.
    bool adapt_state_rate = false;
    /// Datagrams taken in one turn: a flood must not keep states from being sent. A 1 kHz engine sends one per turn.
    std::size_t max_datagrams = 256;
    bool record = true;                ///< false: no datagram goes to the log thread
    DatagramSieve::Config recorded{};  ///< of the datagrams in and out
  };

  using Stats = NetworkStats;

  /// A guest has come or gone: the same for programs that follow sessions.
  struct SessionChange {
    std::uint32_t connection = 0;  ///< that of its datagrams
    bool came = false;
    std::string client{};  ///< the name it gave itself
    Role role = Role::kObserver;
    Address address{};
    std::string device{};    ///< the first of those that it asked for
    std::uint64_t tick = 0;  ///< that device's newest step then
    std::string why{};       ///< it went
  };

  /// What the operator should read in the log.
  struct Notice {
    bool warning = false;
    std::string text;
    std::optional<SessionChange> session{};
  };

  /// A Hello for devices of another shard.
  struct Foreign {
    std::uint32_t shard = 0;  ///< its number
    Address from{};
    std::vector<std::byte> hello{};
  };

  /// The mailboxes of the first device of the shard take the datagrams for the recording. `link` must outlive the loop.
  /// Throws the errors of served_devices().
  NetworkLoop(const Config& config, Link& link, LocalTime now);
  NetworkLoop(const NetworkLoop&) = delete;  // its leases look at its devices
  NetworkLoop& operator=(const NetworkLoop&) = delete;

  /// One round. Returns when the next one is due at the latest.
  LocalTime turn(LocalTime now);

  /// Says goodbye to every guest. The last thing the network thread does.
  void close(LocalTime now);

  /// The Hellos of others' guests since the last call; at most 64 are kept. A client repeats one that got lost.
  std::vector<Foreign> take_foreign();

  /// Takes a Hello that another shard has found to be for this one. That one has recorded it.
  void receive_foreign(LocalTime now, const Address& from, std::span<const std::byte> hello);

  Stats stats() const;

  /// What happened since the last call, for the log; at most 64 are kept.
  std::vector<Notice> take_notices();

 private:
  bool drain(LocalTime& now);  ///< `now` grows with each datagram taken
  void receive(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void greet(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void admit(LocalTime now, const Address& from, const Doorman::Guest& guest, std::span<const std::byte> hello);
  std::uint32_t take_connection_id();
  bool answer_again(LocalTime now, const Address& from, const Doorman::Guest& guest);
  void refuse(LocalTime now, const Address& from, const Doorman::Guest& guest, Refusal refusal);
  void open(LocalTime now, Guest guest);
  void take_events(LocalTime now, Guest& guest);
  void take_force(LocalTime now, Guest& guest, const ForceCommand& command);
  std::uint8_t note(const ForceCommand& command, const Guest& guest, ServedDevice& device);
  void take_refused(Guest& guest);
  void blame(const Guest& guest, Lateness::Cause cause, std::uint64_t count);
  void answer(LocalTime now, Guest& guest, std::uint32_t id, Request request);
  void dispossess(LocalTime now, Guest& loser, const Guest& winner, const TakeLease& lost);
  bool may_take_over(const Guest& guest) const;
  void leave(Guest& guest, const std::string& how);
  void send_all(LocalTime now, Guest& guest);
  void publish(LocalTime now);
  void hear(LocalTime now, Guest& guest);
  void measure(LocalTime now, Guest& guest);
  void adapt(LocalTime now, Guest& guest);
  void report(LocalTime now);
  DatagramSieve::Sender sender_of(const Doorman::Guest& guest, const Address& from) const;
  void send(LocalTime now, DatagramSieve::Sender partner, const Address& to, std::span<const std::byte> datagram);
  void tap(LocalTime now, DatagramRecord::Direction direction, DatagramSieve::Sender partner, const Address& peer,
           std::span<const std::byte> datagram, std::size_t size);
  SessionChange change_of(const Guest& guest, bool came, const std::string& why) const;
  void notice(bool warning, std::string text, std::optional<SessionChange> session = std::nullopt);

  /// Of a device, apart from all else of it: each turn looks at every one of them.
  struct NewestState {
    Latest<DeviceState>* box;
    const DeviceState* fresh = nullptr;  ///< came since the turn before; null: none
  };

  Config config_;
  Link& link_;
  DatagramSieve sieve_;
  std::vector<ServedDevice> devices_;  ///< of this shard
  std::size_t first_device_;           ///< the index of the first device of this shard
  std::vector<NewestState> states_;    ///< by place, as the devices
  Doorman doorman_;
  Admission admission_;
  Leases leases_{devices_};
  Reports reports_;
  std::vector<Guest> guests_;
  PortExchange ports_{devices_, guests_, leases_};
  std::vector<Guest> half_open_;  ///< oldest first
  std::uint32_t next_connection_id_;

  Stats stats_;
  std::vector<Notice> notices_;
  std::vector<Foreign> foreign_;
};

}  // namespace tendon
