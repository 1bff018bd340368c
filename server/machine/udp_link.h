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

/// Who may reach a socket.
enum class Reach : std::uint8_t {
  kThisMachine,  ///< loopback only
  kAnywhere,     ///< only for servers that require a key
};

/// The real link: one UDP socket on an IPv4 or IPv6 address of this machine, or on all of its addresses. 0.0.0.0 means
/// all IPv4 addresses, and [::] means all addresses of both families. The answer to a peer is then sent from the address
/// that the peer has used. A Unix socket for engines on the same machine is optional.
///
/// send() and receive() never wait; wait() is the only place where the network thread sleeps.
/// Anybody may send anything; nothing here looks inside the datagrams.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpLink : public Link {
 public:
  /// Opens and binds; port 0 lets the system choose one (see local_address()). Throws std::invalid_argument when
  /// `listen` is not a loopback address and the caller has not allowed others: without keys anybody on the network
  /// could command forces. Throws std::runtime_error when the system refuses: "cannot listen on 127.0.0.1:47100:
  /// Address already in use".
  ///
  /// `file`: of the Unix socket; throws as UnixSocket does.
  explicit UdpLink(const Address& listen, Reach reach = Reach::kThisMachine,
                   const std::optional<std::filesystem::path>& file = std::nullopt);

  /// Links with one address, each for a thread of its own; `count` is a power of two. Of several the kernel gives Data
  /// to the one whose place is the datagram's connection id modulo `count`, and anything else to the first (SO_REUSEPORT
  /// and a filter, socket(7)). Replies may leave through each of them. Throws as the constructor does.
  static std::vector<std::unique_ptr<UdpLink>> several(const Address& listen, Reach reach, std::uint32_t count);

  ~UdpLink() override;
  UdpLink(const UdpLink&) = delete;
  UdpLink& operator=(const UdpLink&) = delete;

  /// A datagram that the system does not take at once (full buffer, no route, other address family)
  /// is lost, and counted in send_failures().
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// As Link says, of both sockets in turns. Empty datagrams are skipped: they say nothing, and 0 means that none is
  /// waiting.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  /// The time by clock::now().
  LocalTime present(LocalTime now) const override;

  /// Waits until a datagram can be received, or the doorbell rings (it is then answered), or
  /// `timeout` is over, whichever comes first; a signal handler may end it sooner. A timeout of zero
  /// or less does not wait. The resolution is the kernel's: set the thread's timer slack to 1 ns if
  /// 50 µs matter.
  void wait(Duration timeout, Doorbell* doorbell = nullptr);

  /// Where peers can reach this socket; the port is the real one.
  Address local_address() const;

  /// Datagrams that send() could not hand to the system. From any thread.
  std::uint64_t send_failures() const noexcept { return send_failures_.value(); }

  /// The UDP socket's file descriptor, for whoever polls several links at once.
  int fd() const noexcept { return fd_; }

 private:
  struct Further {};
  UdpLink(const UdpLink& first, Further);
  std::size_t receive_from_network(Address& from, std::span<std::byte> buffer);
  bool send_to_network(const Address& to, std::span<const std::byte> datagram) const;

  int fd_ = -1;
  std::unique_ptr<AskedAt> own_asked_at_;
  AskedAt* asked_at_ = nullptr;  ///< that of the first link of the address; null if bound to a single address
  std::optional<UnixSocket> unix_;
  bool unix_first_ = false;  ///< a flood through the one must not close the other
  Counter send_failures_;
};

}  // namespace tendon
