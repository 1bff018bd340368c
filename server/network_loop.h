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
#include "server/clients/admission.h"
#include "server/clients/field_intake.h"
#include "server/clients/leases.h"
#include "server/clients/port_exchange.h"
#include "server/clients/reports.h"
#include "server/clients/served_client.h"
#include "server/mailboxes.h"
#include "server/network_stats.h"
#include "server/recording/datagram_filter.h"

namespace tendon {

/// Admits clients, passes their forces to the haptic loops, and sends them the states of the devices.
///
/// `turn` should be called by a single thread if a datagram has arrived, if a haptic loop has made a step, or at the
/// time returned by the previous call. Each turn drains the link to avoid queueing delays. If there are several forces
/// for a channel, only the newest one is used. All requests are answered (SESSION.md).
///
/// A large server can split its devices between loops (Shard), each with its own thread and link and no other shared
/// state. One loop receives all Hellos; the owner must forward those for others (take_foreign, receive_foreign).
///
/// This class is only responsible for the datagrams. The logic is in clients/: admission.h for new sessions, leases.h
/// for the holders of channels, requests.h for requests, lateness.h for late forces, reports.h for periodic reports.
/// Thread-safe: no. Realtime-safe: no.
class NetworkLoop {
 public:
  struct Config {
    Bytes32 secret{};  ///< for cookies and ephemeral keys; random at each start, equal for all shards
    /// If empty, all clients on this machine are admitted, and sessions are not encrypted.
    std::vector<ClientKey> keys{};
    Suites suites = suites_of_this_machine();  ///< allowed for these sessions
    /// True if the system has checked the sender (UnixSocket::is_peer), so that it needs no key. Can be null.
    bool (*needs_no_key)(const Address& from) noexcept = nullptr;
    Shard shard{};                          ///< `devices` contains the devices of all shards
    std::uint32_t first_connection_id = 1;  ///< should be random at each start
    std::string server_name = "tendond";
    std::vector<ServedDevice::Config> devices{};  ///< at most kMostDevices
    /// Names of the keys, or of the clients if there are no keys, that can take a channel before its lease has expired.
    std::vector<std::string> takeover{};
    /// Each costs this thread about 250 bytes per haptic step. One of several keys can have at most half, rounded up.
    std::size_t max_observers = 8;
    Duration controller_timeout = std::chrono::seconds(2);
    Duration observer_timeout = std::chrono::seconds(10);
    /// If there are more half-open sessions, the oldest one is removed. The limit is required because an attacker can
    /// replay a Hello. It is larger than the number of clients that are expected to connect within one round trip.
    std::size_t max_half_open = 16;
    Duration half_open_timeout = std::chrono::seconds(5);
    Rekey rekey{};  ///< when sealed sessions change their keys
    Duration session_life = Session::Config{}.life;
    /// Reduces the state rate of a client whose link is congested (RateAdaptation). If a tenth of the datagrams is lost
    /// even at the lowest rate, the client's forces are not used, and the device makes a safe stop.
    bool adapt_state_rate = false;
    std::size_t max_datagrams = 256;  ///< in one turn, so that a flood does not delay the states
    bool record = true;               ///< if false, datagrams are not passed to the log thread
    DatagramFilter::Config recorded{};
  };

  using Stats = NetworkStats;

  struct SessionChange {
    std::uint32_t connection = 0;
    bool came = false;
    std::string client{};
    Role role = Role::kObserver;
    Address address{};
    std::string device{};
    std::uint64_t tick = 0;  ///< newest step of that device
    std::string why{};       ///< the reason for leaving
  };

  struct Notice {
    bool warning = false;
    std::string text;
    std::optional<SessionChange> session{};
  };

  struct Foreign {
    std::uint32_t shard = 0;
    Address from{};
    std::vector<std::byte> hello{};
  };

  /// The shard's first mailboxes record datagrams. `link` must outlive the loop. Throws the errors of served_devices().
  NetworkLoop(const Config& config, Link& link, LocalTime now);
  NetworkLoop(const NetworkLoop&) = delete;  // leases_ refers to devices_
  NetworkLoop& operator=(const NetworkLoop&) = delete;

  LocalTime turn(LocalTime now);  ///< processes what is due; returns the latest time of the next call

  void close(LocalTime now);  ///< all sessions with a Bye; no other call may follow

  /// Returns the Hellos for other shards since the last call, at most 64. Clients repeat lost Hellos.
  std::vector<Foreign> take_foreign();

  /// Processes a Hello that was received, and recorded, by another shard.
  void receive_foreign(LocalTime now, const Address& from, std::span<const std::byte> hello);

  Stats stats() const;

  std::vector<Notice> take_notices();

 private:
  static constexpr std::size_t kMaxNotices = 64;

  bool drain(LocalTime& now);  ///< `now` is updated
  void receive(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void greet(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void admit(LocalTime now, const Address& from, const ServerHandshake::Client& client,
             std::span<const std::byte> hello);
  std::uint32_t take_connection_id();
  bool answer_again(LocalTime now, const Address& from, const ServerHandshake::Client& client);
  void refuse(LocalTime now, const Address& from, const ServerHandshake::Client& client, Refusal refusal);
  void open(LocalTime now, ServedClient client);
  void take_events(LocalTime now, ServedClient& client);
  void take_force(LocalTime now, ServedClient& client, const ForceCommand& command);
  std::uint8_t note(const ForceCommand& command, const ServedClient& client, ServedDevice& device);
  void take_refused(ServedClient& client);
  void blame(const ServedClient& client, Lateness::Cause cause, std::uint64_t count);
  void answer(LocalTime now, ServedClient& client, std::uint32_t id, Request request);
  void dispossess(LocalTime now, ServedClient& loser, const ServedClient& winner, const TakeLease& lost);
  bool may_take_over(const ServedClient& client) const;
  void leave(ServedClient& client, const std::string& how);
  void send_all(LocalTime now, ServedClient& client);
  void publish(LocalTime now);
  void hear(LocalTime now, ServedClient& client);
  void measure(LocalTime now, ServedClient& client);
  void adapt(LocalTime now, ServedClient& client);
  void report(LocalTime now);
  DatagramFilter::Sender sender_of(const ServerHandshake::Client& client, const Address& from) const;
  void send(LocalTime now, DatagramFilter::Sender partner, const Address& to, std::span<const std::byte> datagram);
  void tap(LocalTime now, DatagramRecord::Direction direction, DatagramFilter::Sender partner, const Address& peer,
           std::span<const std::byte> datagram, std::size_t size);
  SessionChange change_of(const ServedClient& client, bool came, const std::string& why) const;
  void notice(bool warning, std::string text, std::optional<SessionChange> session = std::nullopt);

  /// In a separate array because it is used in every turn (cache locality).
  struct NewestState {
    Latest<DeviceState>* box;
    const DeviceState* fresh = nullptr;  ///< null if not updated
  };

  Config config_;
  Link& link_;
  DatagramFilter filter_;
  std::vector<ServedDevice> devices_;
  std::size_t first_device_;
  std::vector<NewestState> states_;
  ServerHandshake handshake_;
  Admission admission_;
  Leases leases_{devices_};
  Reports reports_;
  std::vector<ServedClient> clients_;
  PortExchange ports_{devices_, clients_, leases_};
  std::unique_ptr<FieldIntake> fields_;  ///< null if no device has fields
  std::vector<ServedClient> half_open_;  ///< oldest first
  std::uint32_t next_connection_id_;

  Stats stats_;
  std::vector<Notice> notices_;
  std::vector<Foreign> foreign_;
};

}  // namespace tendon
