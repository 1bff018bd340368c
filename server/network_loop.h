// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/session.h"
#include "server/guests/admission.h"
#include "server/guests/guest.h"
#include "server/guests/leases.h"
#include "server/guests/reports.h"
#include "server/mailboxes.h"
#include "server/recording/datagram_sieve.h"

namespace tendon {

/// The other half of the world: lets guests in, hands their forces to the haptic loops and the devices'
/// states to them.
///
/// One thread calls `turn` when a datagram has come, when the haptic loop has made a step, or when the
/// time that the last turn returned has come; it does nothing else but wait and read the clock.
///
/// Observers that ask for it (kFeatureDiagnostics) are told once a second how the devices' loops and the engines do.
///
/// One controller for each channel, who may have to share it with others in turn (a lease, SESSION.md), and up to
/// `max_observers` observers. The link is drained in every turn, so nothing
/// waits behind what is old; forces are newest-wins, every request is answered.
///
/// Without keys guests speak in the clear, from this machine only. With keys they speak suite 1 only: a guest
/// is half-open until its first authentic Data, and until then nothing changes for anybody else; its address
/// is where its newest authentic datagram came from; a controller that comes again with its key takes its own
/// place.
///
/// Thread-safe: no. Realtime-safe: no.
class NetworkLoop {
 public:
  struct Config {
    Bytes32 secret{};                       ///< of cookies and ephemeral keys; random at start
    std::vector<ClientKey> keys{};          ///< who may come in; empty: anybody on this machine, in the clear
    std::uint32_t first_connection_id = 1;  ///< random at start, so that a restarted server does not know old guests
    std::string server_name = "tendond";
    /// What guests are told of each device; its number is its place, `holder` does not count.
    std::vector<DeviceDescription> devices{};
    /// Clients that need not wait for the end of a lease: the names of their keys, without keys their own.
    std::vector<std::string> takeover{};
    /// Each costs a state datagram of some 250 bytes per haptic step. Where there are several keys, one key has at most
    /// half of these places, rounded up.
    std::size_t max_observers = 8;
    Duration controller_timeout = std::chrono::seconds(2);
    Duration observer_timeout = std::chrono::seconds(10);
    /// Handshakes answered whose guest has not shown yet that it holds the keys: anybody may have replayed its
    /// Hello. 16 are more than start within a round trip; the oldest gives way.
    std::size_t max_half_open = 16;
    Duration half_open_timeout = std::chrono::seconds(5);
    Rekey rekey{};  ///< of the sessions of suite 1, as their `life`
    Duration session_life = Session::Config{}.life;
    /// States leave more rarely where the way to a guest is full, see RateAdaptation; where even the lowest rate loses
    /// a tenth, forces are not handed on, and the device comes to its safe stop.
    bool adapt_state_rate = false;
    /// Datagrams taken in one turn; a flood must not keep states from being sent. A 1 kHz engine sends 1 per turn.
    std::size_t max_datagrams = 256;
    DatagramSieve::Config recorded{};  ///< of the datagrams in and out
  };

  /// What guests' links have dropped, of all guests that were and are; see LinkStats.
  struct Dropped {
    std::uint64_t duplicated = 0;
    std::uint64_t malformed = 0;
    std::uint64_t forged = 0;
    std::uint64_t old_key = 0;
    std::uint64_t invalid = 0;
    std::uint64_t stale = 0;
  };

  struct Stats {
    std::uint64_t welcomed = 0;  ///< sessions that were opened
    std::uint64_t refused = 0;
    std::uint64_t timed_out = 0;
    std::uint64_t replaced = 0;  ///< by a guest with the same key
    std::uint64_t roamed = 0;    ///< changes of a guest's address
    std::uint64_t half_open_forgotten = 0;
    std::uint64_t malformed = 0;           ///< datagrams too long, or not of this protocol
    std::uint64_t unknown_connection = 0;  ///< Data that belongs to nobody, or comes from the wrong address
    Doorman::Stats hellos;                 ///< Hellos that did not lead to an Answer
    std::uint64_t forces = 0;              ///< handed to the haptic loop
    std::uint64_t denied = 0;              ///< forces and requests that only the holder of a channel may send
    std::uint64_t unanswerable = 0;        ///< forces that answer a step which never was, or long ago
    std::uint64_t late_ours = 0;           ///< forces that came when the one before had outlived its validity: by us,
    std::uint64_t late_network = 0;        ///< … the network,
    std::uint64_t late_engine = 0;         ///< … and the engine; see Lateness
    std::uint64_t foretold = 0;            ///< states left out because their client can foretell them
    std::uint64_t hopeless = 0;            ///< forces not handed on, over a link of no use
    Dropped dropped;
    struct Channel {
      std::string device;
      std::string channel;
      std::string holder;           ///< its name; empty: nobody
      std::uint64_t forces = 0;     ///< handed on
      std::uint64_t handovers = 0;  ///< from one holder to another who wanted it
      std::uint64_t late = 0;       ///< as above
    };
    std::vector<Channel> channels;
    LinkStats controller;  ///< the link of the present controller, or of the last one
    std::optional<ClockOffsetEstimator::Estimate> controller_clock;  ///< … and its clock, by ours
  };

  /// What the operator should read in the log.
  struct Notice {
    bool warning = false;
    std::string text;
  };

  /// One of `mail` for each device; datagrams go to the first. They and `link` must outlive the loop. Throws
  /// std::invalid_argument when there are as many devices or channels as cannot be, or two of one name.
  NetworkLoop(const Config& config, Link& link, std::vector<Mailboxes*> mail);

  /// One round. Returns when the next one is due at the latest.
  LocalTime turn(LocalTime now);

  /// Says goodbye to every guest. The last thing the network thread does.
  void close(LocalTime now);

  Stats stats() const;

  /// What happened since the last call, for the log; at most 64 are kept.
  std::vector<Notice> take_notices();

 private:
  bool drain(LocalTime& now);  ///< `now` goes on with what it takes
  void receive(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void greet(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void admit(LocalTime now, const Address& from, const Doorman::Guest& guest);
  bool answer_again(LocalTime now, const Address& from, const Doorman::Guest& guest);
  void open(LocalTime now, Guest guest);
  void take_events(LocalTime now, Guest& guest);
  void take_force(LocalTime now, Guest& guest, const ForceCommand& command);
  void answer(LocalTime now, Guest& guest, std::uint32_t id, const Request& request);
  void order(Guest& guest, std::uint32_t id, std::uint32_t device, HapticOrder::Kind kind);
  void take_lease(LocalTime now, Guest& guest, std::uint32_t id, const TakeLease& wanted);
  void dispossess(LocalTime now, std::uint32_t loser, const TakeLease& lost, const std::string& to);
  void leave(Guest& guest, const std::string& how);
  void send_all(LocalTime now, Guest& guest);
  void publish(LocalTime now);
  void measure(LocalTime now, Guest& guest);
  void adapt(LocalTime now, Guest& guest);
  void report(LocalTime now);
  DatagramSieve::Sender sender_of(const Doorman::Guest& guest) const;
  void send(LocalTime now, DatagramSieve::Sender partner, const Address& to, std::span<const std::byte> datagram);
  void tap(LocalTime now, DatagramRecord::Direction direction, DatagramSieve::Sender partner, const Address& peer,
           std::span<const std::byte> datagram, std::size_t size);
  void notice(bool warning, std::string text);

  Config config_;
  Link& link_;
  DatagramSieve sieve_;
  std::vector<ServedDevice> devices_;
  Doorman doorman_;
  std::vector<Guest> guests_;
  Admission admission_;
  Leases leases_;
  Reports reports_;
  std::vector<Guest> half_open_;  ///< oldest first
  std::uint32_t next_connection_id_;

  Stats stats_;
  std::vector<Notice> notices_;
};

}  // namespace tendon
