// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "protocol/link.h"

/// Passes the local address of a datagram in the control messages of recvmsg(2) and sendmsg(2), see ip(7) and ipv6(7).
namespace tendon::local_address {

using Ip = decltype(Address::ip);

inline constexpr std::size_t kControlBytes = CMSG_SPACE(sizeof(in6_pktinfo));

/// Enables the control message. `family` is AF_INET, or AF_INET6 for both. Returns false and sets errno on failure.
[[nodiscard]] inline bool ask(int fd, int family) noexcept {
  const bool v4 = family == AF_INET;
  const int on = 1;
  return ::setsockopt(fd, v4 ? IPPROTO_IP : IPPROTO_IPV6, v4 ? IP_PKTINFO : IPV6_RECVPKTINFO, &on, sizeof on) == 0;
}

/// Returns false if the control message does not contain an address.
inline bool read(const cmsghdr& control, Ip& ip) noexcept {
  if (control.cmsg_level == IPPROTO_IP && control.cmsg_type == IP_PKTINFO) {
    in_pktinfo info{};
    std::memcpy(&info, CMSG_DATA(&control), sizeof info);
    std::copy(kMappedIpv4.begin(), kMappedIpv4.end(), ip.begin());
    std::memcpy(ip.data() + kMappedIpv4.size(), &info.ipi_spec_dst, sizeof info.ipi_spec_dst);
    return true;
  }
  if (control.cmsg_level == IPPROTO_IPV6 && control.cmsg_type == IPV6_PKTINFO) {
    in6_pktinfo info{};
    std::memcpy(&info, CMSG_DATA(&control), sizeof info);
    std::memcpy(ip.data(), &info.ipi6_addr, sizeof info.ipi6_addr);
    return true;
  }
  return false;
}

/// Sets the source address of the datagram to `ip`. msg_control must point to a buffer of kControlBytes.
inline void write(const Ip& ip, msghdr& header) noexcept {
  const auto put = [&header](int level, int type, const auto& info) {
    header.msg_controllen = CMSG_SPACE(sizeof info);
    cmsghdr& control = *CMSG_FIRSTHDR(&header);
    control.cmsg_level = level;
    control.cmsg_type = type;
    control.cmsg_len = CMSG_LEN(sizeof info);
    std::memcpy(CMSG_DATA(&control), &info, sizeof info);
  };
  if (is_ipv4({ip, 0})) {
    in_pktinfo info{};
    std::memcpy(&info.ipi_spec_dst, ip.data() + kMappedIpv4.size(), sizeof info.ipi_spec_dst);
    put(IPPROTO_IP, IP_PKTINFO, info);
  } else {
    in6_pktinfo info{};
    std::memcpy(&info.ipi6_addr, ip.data(), sizeof info.ipi6_addr);
    put(IPPROTO_IPV6, IPV6_PKTINFO, info);
  }
}

}  // namespace tendon::local_address
