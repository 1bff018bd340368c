// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>

namespace tendon {

/// The mark in the IP header by which routers and switches choose the queue of a datagram (RFC 2474), if they are
/// configured for it.
enum class Dscp : std::uint8_t {
  kExpedited = 46,  ///< EF, expedited forwarding (RFC 3246), for low delay, delay variation and loss
};

/// Marks all datagrams that a UDP socket will send, over IPv4 and IPv6. Returns false and sets errno on failure.
[[nodiscard]] inline bool mark(int fd, Dscp dscp) noexcept {
  const auto set = [fd](int level, int option, int value) {
    return ::setsockopt(fd, level, option, &value, sizeof value) == 0;
  };
  int family = 0;
  socklen_t size = sizeof family;
  if (::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &family, &size) != 0) return false;
  const int traffic_class = static_cast<int>(dscp) << 2;  // the lowest two bits are for congestion (RFC 3168)
  // A socket of IPv6 needs both, because it sends to IPv4-mapped addresses over IPv4.
  if (family == AF_INET6 && !set(IPPROTO_IPV6, IPV6_TCLASS, traffic_class)) return false;
  if (!set(IPPROTO_IP, IP_TOS, traffic_class)) return false;
  // The queues of this machine use the priority of the socket. This must be last, because IP_TOS sets it too, and
  // IPV6_TCLASS does not.
  constexpr int kInteractive = 6;  // TC_PRIO_INTERACTIVE, the highest one without privileges
  return set(SOL_SOCKET, SO_PRIORITY, kInteractive);
}

}  // namespace tendon
