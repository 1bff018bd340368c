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

/// More would be hardly faster, and due datagrams would wait behind incoming ones.
inline constexpr std::size_t kUdpBatch = 64;

/// A non-blocking UDP socket, IPv4 or IPv6, with recvmmsg(2) and sendmmsg(2). Thread-safe: no.
class UdpBatch {
 public:
  /// 0.0.0.0: all IPv4 addresses; [::]: all of both families; port 0: any free one. Throws std::runtime_error on
  /// failure, for example "cannot listen on 127.0.0.1:47100: Address already in use".
  static UdpBatch listening(const Address& address);

  /// Opens a socket on a free port that exchanges datagrams only with `server`. Throws std::runtime_error on failure.
  static UdpBatch connected(const Address& server);

  UdpBatch(UdpBatch&& other) noexcept;
  UdpBatch& operator=(UdpBatch&& other) noexcept;
  ~UdpBatch();

  struct Arrival {
    Address from;      ///< only from a listening socket
    Address asked_at;  ///< the local address, without a port; only if bound to all addresses
    LocalTime at;      ///< kernel receive time (SO_TIMESTAMPNS), possibly long before the call
    std::span<const std::byte> datagram;
  };
  /// Memory for one batch of arrivals. Several sockets can share it if they receive one after the other.
  class Inbox;

  /// The datagrams are valid until `inbox` is used again. Arrival times are at most the current time; it replaces a
  /// stamp more than a second old, because then the real-time clock was set.
  std::span<const Arrival> receive(Inbox& inbox);

  struct Outgoing {
    Address to;
    std::span<const std::byte> datagram;
    Address from = {};  ///< the local address to send from, or zeros to let the kernel choose
  };
  /// Sends up to kUdpBatch datagrams in order. Returns the set of those that the kernel refused (full buffer, no route,
  /// larger than the path allows), which are skipped.
  std::bitset<kUdpBatch> send(std::span<const Outgoing> batch);

  /// Drops due to a full receive buffer (SO_RXQ_OVFL), as of the last received datagram.
  std::uint64_t overflowed() const noexcept { return overflowed_; }

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
  struct Memory;  // defined in the source file to avoid including system headers
  std::unique_ptr<Memory> memory_;
};

}  // namespace tendon::injector
