// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/base/time.h"
#include "protocol/link.h"

namespace tendon::injector {

/// Datagrams that one system call takes or gives. More would hardly be faster, and would let those that are due wait
/// behind those that come in.
inline constexpr std::size_t kUdpBatch = 64;

/// One UDP socket, IPv4 or IPv6, that takes and gives datagrams by the batch (recvmmsg(2), sendmmsg(2)) and never
/// waits.
///
/// Thread-safe: no.
class UdpBatch {
 public:
  /// Binds to `address`. 0.0.0.0 means all IPv4 addresses, and [::] means all addresses of both families. If the port is
  /// 0, the system chooses one. Throws std::runtime_error when the system refuses: "cannot listen on
  /// 127.0.0.1:47100: Address already in use".
  static UdpBatch listening(const Address& address);

  /// From any free port to `server` only: what others send to that port, the kernel throws away. Throws
  /// std::runtime_error when the system refuses.
  static UdpBatch connected(const Address& server);

  UdpBatch(UdpBatch&& other) noexcept;
  UdpBatch& operator=(UdpBatch&& other) noexcept;
  ~UdpBatch();

  struct Arrival {
    Address from;      ///< only of a listening socket
    Address asked_at;  ///< the local address, without a port; only if bound to all addresses
    LocalTime at;      ///< when the kernel got it (SO_TIMESTAMPNS), which may be long before we read it
    std::span<const std::byte> datagram;
  };
  /// Memory for one batch of arrivals of any size; several sockets can share one, one after the other.
  class Inbox;

  /// Takes up to kUdpBatch datagrams, which are valid until `inbox` is used again. No time of arrival is in the future,
  /// nor more than a second in the past: then the calendar's clock was set, and the time is that of this call.
  std::span<const Arrival> receive(Inbox& inbox);

  struct Outgoing {
    Address to;  ///< only for a listening socket
    std::span<const std::byte> datagram;
    Address from = {};  ///< the local address to send from, or zeros to let the kernel choose
  };
  /// Gives up to kUdpBatch datagrams to the kernel, in order. Says which of them it did not take (full buffer, no
  /// route, larger than the path allows): they are passed over.
  std::bitset<kUdpBatch> send(std::span<const Outgoing> batch);

  /// Datagrams that came when the socket's buffer was full, so that the kernel threw them away (SO_RXQ_OVFL), as far as
  /// datagrams received since then told.
  std::uint64_t overflowed() const noexcept { return overflowed_; }

  /// Where peers can reach this socket.
  Address local_address() const;

  int fd() const noexcept { return fd_; }

 private:
  UdpBatch(const Address& family, const Address* bind_to, const Address* connect_to);

  int fd_ = -1;
  bool connected_ = false;
  bool on_all_addresses_ = false;
  std::uint32_t overflowed_ = 0;
};

class UdpBatch::Inbox {
 public:
  Inbox();
  ~Inbox();

 private:
  friend class UdpBatch;
  struct Memory;  // keeps the system's headers out of this one
  std::unique_ptr<Memory> memory_;
};

}  // namespace tendon::injector
