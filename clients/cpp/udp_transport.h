// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {

/// The guest's end of the wire: a UDP socket that talks to one server, from a port that the system
/// chooses. It is connected, so the kernel drops what others send to it.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpTransport : public Link {
 public:
  /// Throws std::runtime_error when the system refuses: "cannot reach 192.0.2.1:47100: Network is unreachable".
  explicit UdpTransport(const Address& server);
  ~UdpTransport() override;

  /// `to` must be the server; a datagram to anybody else, or one that the system does not take, is lost.
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// As Link says. Empty datagrams are skipped: they say nothing, and 0 means that none is waiting.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  /// The time by std::chrono::steady_clock, as run() passes it.
  LocalTime received_by(LocalTime now) const override;

  /// Sleeps until a datagram can be received or `timeout` is over; a signal handler may end it sooner.
  /// A timeout of zero or less does not sleep.
  void wait(Duration timeout);

 private:
  struct Socket;  // keeps Asio out of this header
  Address server_;
  std::unique_ptr<Socket> socket_;
};

}  // namespace tendon
