// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "clients/cpp/dscp.h"
#include "clients/cpp/kernel_stamps.h"
#include "clients/cpp/server_name.h"
#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {

/// A socket connected to one server: UDP from an ephemeral port or, for "unix:PATH", a Unix datagram socket with an
/// autobind address. Since the socket is connected, the kernel drops datagrams from other senders.
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpTransport : public Link {
 public:
  /// Resolves the name (ServerName::look_up, which may block) and uses the first reachable address. Throws
  /// std::runtime_error if there is none, "cannot find haptics.lab: Name or service not known" or "cannot reach
  /// 192.0.2.1:47100: Network is unreachable", or if `server` is a DNS-SD name and `has_key` is false. With `dscp`, all
  /// datagrams are marked.
  explicit UdpTransport(const ServerName& server, bool has_key = false, std::optional<Dscp> dscp = std::nullopt);
  ~UdpTransport() override;
  UdpTransport(const UdpTransport&) = delete;
  UdpTransport& operator=(const UdpTransport&) = delete;

  const Address& server() const noexcept { return server_; }
  const std::string& device() const noexcept { return device_; }  ///< device name found by DNS-SD; empty: none

  /// Resolves the name again, which may block. This must only be called while no session is open. Keeps the address if
  /// the name still resolves to it, or selects the next one if `another` is true. Reopens a Unix socket, because its
  /// path may belong to a new server. Throws the same exceptions as the constructor and then keeps the address.
  void look_up_again(bool another);

  /// `to` must be server(). Datagrams to other addresses, and those that the system rejects, are dropped.
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// See Link::receive. Empty datagrams are skipped because the result 0 means that none is available.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  LocalTime present(LocalTime now) const override;  ///< reads std::chrono::steady_clock, the clock that run() uses
  LocalTime arrived(LocalTime now) const override { return std::max(now, stamps_.read()); }
  LocalTime reached(LocalTime now) const override { return std::min(now, stamps_.reached()); }

  int descriptor() const noexcept { return fd_; }  ///< of the socket, for poll(); changes in look_up_again()

  /// Waits for a datagram or until `timeout` has elapsed. A signal may end the wait. Returns at once if `timeout` ≤ 0.
  /// The first wait enables the time stamps of the kernel.
  void wait(Duration timeout);
  /// Sleeps until one of `transports` or the descriptor `also` (−1: none) is readable, or until the timeout. Returns
  /// whether one of them is readable.
  static bool wait_for_any(std::span<UdpTransport* const> transports, Duration timeout, int also = -1);

 private:
  void connect_to_file();
  void connect(const std::vector<Address>& addresses, std::size_t first);
  void use(int connected) noexcept;
  void ask_for_stamps() noexcept;

  ServerName name_;
  bool has_key_;
  std::optional<Dscp> dscp_;
  Address server_;
  std::string device_;
  int fd_ = -1;
  bool stamped_ = false;
  KernelStamps stamps_;
};

}  // namespace tendon
