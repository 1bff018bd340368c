// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "clients/cpp/server_name.h"
#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {

/// The guest's end of the wire: a UDP socket that talks to one server, from a port that the system chooses; or, for
/// "unix:PATH", a Unix datagram socket that talks to a server on this machine, from a name that the kernel chooses. The
/// socket is connected, so the kernel drops what others send to it.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpTransport : public Link {
 public:
  /// Looks the name up (ServerName::look_up, which may wait) and takes the first address that the system can reach.
  /// Throws std::runtime_error when there is none: "cannot find haptics.lab: Name or service not known",
  /// "cannot reach 192.0.2.1:47100: Network is unreachable"; and for a name of DNS-SD unless `has_key` promises that
  /// the sessions here have a key.
  explicit UdpTransport(const ServerName& server, bool has_key = false);
  ~UdpTransport() override;
  UdpTransport(const UdpTransport&) = delete;
  UdpTransport& operator=(const UdpTransport&) = delete;

  /// The address in use.
  const Address& server() const noexcept { return server_; }
  /// The device that DNS-SD names beside it; empty: none.
  const std::string& device() const noexcept { return device_; }

  /// Looks the name up again, which may wait: to be called while no session is open. Stays with the present address
  /// where the name still has it, or, with `another`, goes on to the one after it. A Unix socket's file may be another
  /// server's by now: it is opened again. Throws as the constructor does; then the present address stays in use.
  void look_up_again(bool another);

  /// `to` must be server(); a datagram to anybody else, or one that the system does not take, is lost.
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// As Link says. Empty datagrams are skipped: they say nothing, and 0 means that none is waiting.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  /// The time by std::chrono::steady_clock, as run() passes it.
  LocalTime present(LocalTime now) const override;

  /// The socket's file descriptor, for a caller that sleeps on other things too: poll() says when it can be read. Another
  /// one after look_up_again().
  int descriptor() const noexcept { return fd_; }

  /// Sleeps until a datagram can be received or `timeout` is over; a signal handler may end it sooner.
  /// A timeout of zero or less does not sleep.
  void wait(Duration timeout);
  /// The same, until one of `transports` can receive, or the file `also` can be read (−1: none). Whether one of these
  /// is so.
  static bool wait_for_any(std::span<UdpTransport* const> transports, Duration timeout, int also = -1);

 private:
  void connect_to_file();
  void connect(const std::vector<Address>& addresses, std::size_t first);
  void use(int connected) noexcept;

  ServerName name_;
  bool has_key_;
  Address server_;
  std::string device_;
  int fd_ = -1;
};

}  // namespace tendon
