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

/// A connection to another server for a coupled device. This server acts as an ordinary client: it claims a channel,
/// takes the lease, and sends a Couple request. Then, PortStates are exchanged in both directions. If the connection
/// fails, it is established again. Each problem is only reported once. The owner of this object sends and receives the
/// datagrams, because a server has one socket. Thread-safe: no. Realtime-safe: no.
class Peer {
 public:
  struct Config {
    Address server;
    std::string name;
    std::optional<Key> key{};  ///< if empty, the session is not encrypted, and the server must be on this machine
    Seed seed{};               ///< must be random
    std::string device{};      ///< of the server; if empty, the first one
    std::string channel{};     ///< of the device; if empty, the first one
    Couple couple{};
  };
  struct Notice {
    bool warning = false;
    std::string text;
  };
  using Send = std::function<void(LocalTime now, const Address& to, std::span<const std::byte> datagram)>;

  Peer(const Config& config, Send send, LocalTime now);
  Peer(const Peer&) = delete;  // connection_ refers to line_
  Peer& operator=(const Peer&) = delete;

  /// Returns true if the datagram may be from this server and must be passed to receive().
  bool is_from_server(const Address& from, std::span<const std::byte> datagram) const;
  void receive(LocalTime now, const Address& from, std::span<const std::byte> datagram, LocalTime reached);
  LocalTime turn(LocalTime now);  ///< processes what is due; returns the latest time of the next call

  void send(LocalTime now, const PortState& port);  ///< no effect unless coupled
  std::optional<PortState> take();                  ///< each state of the peer only once

  void close(LocalTime now);

  bool coupled() const noexcept { return coupled_; }
  std::vector<Notice> take_notices();

 private:
  class Line final : public Link {
   public:
    explicit Line(Send send) : send_(std::move(send)) {}
    void send(const Address& to, std::span<const std::byte> datagram) override { send_(now, to, datagram); }
    std::size_t receive(Address& from, std::span<std::byte> buffer) override;
    LocalTime reached(LocalTime /*now*/) const override { return reached_at; }

    LocalTime now{};
    LocalTime reached_at{};  ///< for `arrived`
    Address from;
    std::span<const std::byte> arrived;

   private:
    Send send_;
  };

  void greet(LocalTime now);
  void take(LocalTime now, const Connection::Event& event);
  void take(LocalTime now, const Session::Event& event);
  void open(const Welcome& welcome);
  LocalTime next_request() const noexcept;  ///< when to request the lease or, if it is held, the coupling
  void ask(LocalTime now);
  void answered(LocalTime now, const Session::RequestAnswered& answer);
  void say(bool warning, std::string text);

  Config config_;
  Line line_;
  Connection connection_;
  LeaseRequest lease_;  ///< also stores the numbers of the device and of the channel
  bool coupled_ = false;
  std::optional<std::uint32_t> asked_to_couple_;
  LocalTime couple_at_ = LocalTime::max();
  std::optional<PortState> newest_;
  std::string said_;
  std::vector<Notice> notices_;
};

}  // namespace tendon
