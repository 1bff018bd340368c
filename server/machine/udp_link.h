// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "core/exchange/counter.h"
#include "protocol/link.h"
#include "server/machine/asked_at.h"
#include "server/machine/doorbell.h"
#include "server/machine/unix_socket.h"

namespace tendon {

/// Determines who can connect to a socket.
enum class Reach : std::uint8_t {
  kThisMachine,  ///< loopback only
  kAnywhere,     ///< requires keys
};

/// A UDP socket on one or all of the IPv4 or IPv6 addresses of this machine. The address 0.0.0.0 means all IPv4
/// addresses, and [::] means all addresses of both families. In this case, the reply to a peer is sent from the address
/// that was used by the peer. Optionally, there is also a Unix socket for engines on the same machine.
///
/// The functions send() and receive() do not block. The network thread only sleeps in wait(). The content of datagrams
/// is not checked.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpLink : public Link {
 public:
  /// Opens the socket. If the port is 0, it is chosen by the system (see local_address()). Throws std::invalid_argument
  /// if `listen` is not a loopback address and `reach` does not allow this. Without keys, anybody on the network would
  /// be able to command forces. Throws std::runtime_error if the system refuses, for example "cannot listen on
  /// 127.0.0.1:47100: Address already in use".
  ///
  /// If `file` is set, a Unix socket is created as well. Throws the errors of UnixSocket.
  explicit UdpLink(const Address& listen, Reach reach = Reach::kThisMachine,
                   const std::optional<std::filesystem::path>& file = std::nullopt);

  /// Creates links that share an address. Each link should be used in a separate thread, and `count` must be a power of
  /// two. The kernel distributes Data datagrams based on the connection id modulo `count`. All other datagrams are
  /// received by the first link. This is implemented with SO_REUSEPORT and a filter (socket(7)). All links can be used
  /// to send. Throws the same errors as the constructor.
  static std::vector<std::unique_ptr<UdpLink>> several(const Address& listen, Reach reach, std::uint32_t count);

  ~UdpLink() override;
  UdpLink(const UdpLink&) = delete;
  UdpLink& operator=(const UdpLink&) = delete;

  /// If the datagram cannot be sent immediately, it is dropped and counted in send_failures(). For example, the buffer
  /// is full, there is no route, or the address family is different.
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// See Link. If there is a Unix socket, both sockets are read alternately. Empty datagrams are skipped because a size
  /// of 0 means that there is no datagram.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  /// Returns clock::now().
  LocalTime present(LocalTime now) const override;

  /// Waits until a datagram can be received, the doorbell rings, or `timeout` has elapsed. It may return early if a
  /// signal handler is called. If the doorbell has rung, it is answered. This does not block if `timeout` is not
  /// positive. The resolution is determined by the timer slack of the thread, which is 50 µs by default.
  void wait(Duration timeout, Doorbell* doorbell = nullptr);

  /// Returns the address of the socket with the actual port.
  Address local_address() const;

  /// Returns the number of datagrams that have been dropped by send(). Thread-safe: yes.
  std::uint64_t send_failures() const noexcept { return send_failures_.value(); }

  /// Returns the file descriptor of the UDP socket, for polling several links.
  int fd() const noexcept { return fd_; }

 private:
  struct Further {};
  UdpLink(const UdpLink& first, Further);
  std::size_t receive_from_network(Address& from, std::span<std::byte> buffer);
  bool send_to_network(const Address& to, std::span<const std::byte> datagram) const;

  int fd_ = -1;
  std::unique_ptr<AskedAt> own_asked_at_;
  AskedAt* asked_at_ = nullptr;  ///< owned by the first link; null if bound to a single address
  std::optional<UnixSocket> unix_;
  bool unix_first_ = false;  ///< which socket is read first, to prevent starvation
  Counter send_failures_;
};

}  // namespace tendon
