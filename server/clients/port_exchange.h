// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "server/clients/leases.h"
#include "server/clients/peer.h"
#include "server/clients/served_client.h"

namespace tendon {

/// Exchanges the ports of coupled devices with their peers. A peer is a client that holds a channel of the device, or a
/// server that this server is connected to. Both ports are also sent to observers. Thread-safe: no. Realtime-safe: no.
class PortExchange {
 public:
  PortExchange(std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients, Leases& leases);

  /// `send` is called for each datagram to this server.
  void dial(LocalTime now, std::uint32_t device, const Peer::Config& server, Peer::Send send);

  void publish(LocalTime now);

  /// Passes a port to the haptic loop. Returns false and has no effect if the client is not the peer of a coupling.
  bool take(LocalTime now, const ServedClient& client, const PortFrame& port);

  /// Returns false if the datagram is not from a dialled server.
  bool receive(LocalTime now, const Address& from, std::span<const std::byte> datagram, LocalTime reached);

  LocalTime turn(LocalTime now);
  std::vector<Peer::Notice> take_notices();

  void close(LocalTime now);

 private:
  struct Dialled {
    std::uint32_t device;
    std::unique_ptr<Peer> peer;
    bool coupled = false;
  };

  void renew(Dialled& dialled);
  void arrived(LocalTime now, std::uint32_t index, std::uint32_t coupling, std::uint32_t channel,
               const PortState& port);
  void publish(LocalTime now, std::uint32_t device, std::uint32_t coupling, const PortState& port);
  void show(LocalTime now, std::uint32_t index, std::uint32_t coupling, PortFrame mine);

  std::vector<ServedDevice>& devices_;
  std::vector<ServedClient>& clients_;
  Leases& leases_;
  std::vector<std::uint32_t> coupled_;
  std::vector<Dialled> dialled_;
};

}  // namespace tendon
