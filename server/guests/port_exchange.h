// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "server/guests/guest.h"
#include "server/guests/leases.h"
#include "server/guests/peer.h"

namespace tendon {

/// Exchanges the ports of coupled devices with the other ends. The other end is either a client that holds a channel of
/// the device, or a server that this server has dialled. Observers receive the ports of both ends.
///
/// Thread-safe: no. Realtime-safe: no.
class PortExchange {
 public:
  /// The arguments must outlive this object.
  PortExchange(std::vector<ServedDevice>& devices, std::vector<Guest>& guests, Leases& leases);

  /// Connects to a server and couples the device with it. `send` is called with each datagram for this server.
  void dial(LocalTime now, std::uint32_t device, const Peer::Config& server, Peer::Send send);

  /// Takes the ports from the mailboxes of the devices and sends them.
  void publish(LocalTime now);

  /// Passes a port to the haptic loop. Returns false, and does nothing, if the guest is not the other end.
  bool take(LocalTime now, const Guest& guest, const PortFrame& port);

  /// Returns false if the datagram does not come from one of the servers that were dialled.
  bool receive(LocalTime now, const Address& from, std::span<const std::byte> datagram);

  /// Advances the connections to these servers. Returns when the next call is due.
  LocalTime turn(LocalTime now);
  std::vector<Peer::Notice> take_notices();

  /// Closes these connections with a Bye.
  void close(LocalTime now);

 private:
  struct Dialled {
    std::uint32_t device;
    std::unique_ptr<Peer> peer;
    bool coupled = false;  ///< the device's loop knows
  };

  void renew(Dialled& dialled);
  void arrived(LocalTime now, std::uint32_t place, std::uint32_t coupling, std::uint32_t channel,
               const PortState& port);
  void publish(LocalTime now, std::uint32_t device, std::uint32_t coupling, const PortState& port);
  void show(LocalTime now, std::uint32_t place, std::uint32_t coupling, PortFrame mine);

  std::vector<ServedDevice>& devices_;
  std::vector<Guest>& guests_;
  Leases& leases_;
  std::vector<std::uint32_t> coupled_;  ///< places of the devices that may be coupled
  std::vector<Dialled> dialled_;
};

}  // namespace tendon
