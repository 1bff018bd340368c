// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/connection.h"
#include "protocol/lease_request.h"
#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {

/// The server that this one dials for a coupled device: there this one is an ordinary guest, with the same handshake,
/// keys, leases and refusals. It claims a channel, takes its lease, says Couple, and from then on PortStates go both
/// ways. It tries for ever (Connection); what stands in its way it says once.
///
/// Its owner moves the datagrams: both servers have one socket each.
///
/// Thread-safe: no. Realtime-safe: no.
class Peer {
 public:
  struct Config {
    Address server;
    std::string name;          ///< for its log
    std::optional<Key> key{};  ///< empty: in the clear, on this machine only
    Seed seed{};               ///< 32 bytes from the system
    std::string device{};      ///< of it; empty: its first
    std::string channel{};     ///< of that; empty: its first
    Couple couple{};           ///< what our end is like
  };
  /// What the operator should read in the log.
  struct Notice {
    bool warning = false;
    std::string text;
  };
  using Send = std::function<void(LocalTime now, const Address& to, std::span<const std::byte> datagram)>;

  /// `send` is called with each datagram that is to leave.
  Peer(const Config& config, Send send, LocalTime now);
  Peer(const Peer&) = delete;  // its connection holds a reference to its line
  Peer& operator=(const Peer&) = delete;

  /// Whether the datagram may be its server's: then it is given to receive(), and to nobody else.
  bool is_from_server(const Address& from, std::span<const std::byte> datagram) const;
  void receive(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  /// Does what is due; returns when the next turn is due at the latest.
  LocalTime turn(LocalTime now);

  /// To the other end; dropped while the two are not coupled.
  void send(LocalTime now, const PortState& port);
  /// The newest state of the other end, once.
  std::optional<PortState> take();

  /// Says goodbye.
  void close(LocalTime now);

  bool coupled() const noexcept { return coupled_; }
  std::vector<Notice> take_notices();

 private:
  /// The one datagram that has come, and the way out.
  class Line final : public Link {
   public:
    explicit Line(Send send) : send_(std::move(send)) {}
    void send(const Address& to, std::span<const std::byte> datagram) override { send_(now, to, datagram); }
    std::size_t receive(Address& from, std::span<std::byte> buffer) override;

    LocalTime now{};
    Address from;
    std::span<const std::byte> arrived;  ///< empty: none
   private:
    Send send_;
  };

  void greet(LocalTime now);
  void take(LocalTime now, const Connection::Event& event);
  void take(LocalTime now, const Session::Event& event);
  void open(const Welcome& welcome);
  /// When the next request is due: the lease first, then the coupling.
  LocalTime next_request() const noexcept;
  void ask(LocalTime now);
  void answered(LocalTime now, const Session::RequestAnswered& answer);
  void say(bool warning, std::string text);

  Config config_;
  Line line_;
  Connection connection_;
  LeaseRequest lease_;  ///< of the channel, and the numbers of device and channel
  bool coupled_ = false;
  std::optional<std::uint32_t> asked_to_couple_;  ///< the Couple that waits for its answer
  LocalTime couple_at_ = LocalTime::max();        ///< when the next one is due
  std::optional<PortState> newest_;
  std::string said_;  ///< what was said last
  std::vector<Notice> notices_;
};

}  // namespace tendon
