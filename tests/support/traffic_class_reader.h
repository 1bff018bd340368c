// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <string>

#include "protocol/link.h"

namespace tendon {

/// A UDP socket on a loopback address that tells the traffic class of each datagram that it receives: the byte TOS of
/// IPv4, or the traffic class of IPv6.
class TrafficClassReader {
 public:
  static constexpr int kNothing = -1;  ///< no datagram has arrived
  static constexpr int kExpedited = 46 << 2;

  explicit TrafficClassReader(int family) : fd_(::socket(family, SOCK_DGRAM, 0)), family_(family) {
    const int on = 1;
    const bool v4 = family == AF_INET;
    EXPECT_EQ(::setsockopt(fd_, v4 ? IPPROTO_IP : IPPROTO_IPV6, v4 ? IP_RECVTOS : IPV6_RECVTCLASS, &on, sizeof on), 0);
    EXPECT_EQ(::bind(fd_, name(), size()), 0);
    socklen_t length = size();
    EXPECT_EQ(::getsockname(fd_, name(), &length), 0);
  }
  ~TrafficClassReader() { ::close(fd_); }
  TrafficClassReader(const TrafficClassReader&) = delete;
  TrafficClassReader& operator=(const TrafficClassReader&) = delete;

  std::string text() const {
    return (family_ == AF_INET ? "127.0.0.1:" : "[::1]:") +
           std::to_string(ntohs(family_ == AF_INET ? v4_.sin_port : v6_.sin6_port));
  }
  Address address() const { return parse_address(text()); }

  void send(std::uint16_t port, std::span<const std::byte> datagram) {
    sockaddr_in v4 = v4_;
    sockaddr_in6 v6 = v6_;
    v4.sin_port = v6.sin6_port = htons(port);
    const auto* to = family_ == AF_INET ? reinterpret_cast<sockaddr*>(&v4) : reinterpret_cast<sockaddr*>(&v6);
    EXPECT_EQ(::sendto(fd_, datagram.data(), datagram.size(), 0, to, size()), static_cast<ssize_t>(datagram.size()));
  }

  int next() {
    constexpr int kPatienceMs = 10'000;  // only reached if a test fails
    pollfd entry{fd_, POLLIN, 0};
    ::poll(&entry, 1, kPatienceMs);
    std::array<std::byte, 2048> bytes;
    alignas(cmsghdr) std::array<char, 256> control{};
    iovec piece{bytes.data(), bytes.size()};
    msghdr header{};
    header.msg_iov = &piece;
    header.msg_iovlen = 1;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    if (::recvmsg(fd_, &header, MSG_DONTWAIT) < 0) return kNothing;
    int traffic_class = 0;
    for (cmsghdr* said = CMSG_FIRSTHDR(&header); said != nullptr; said = CMSG_NXTHDR(&header, said)) {
      // IPv4 tells one byte, and IPv6 an int.
      if ((said->cmsg_level == IPPROTO_IP && said->cmsg_type == IP_TOS) ||
          (said->cmsg_level == IPPROTO_IPV6 && said->cmsg_type == IPV6_TCLASS)) {
        std::memcpy(&traffic_class, CMSG_DATA(said), std::min(sizeof traffic_class, said->cmsg_len - CMSG_LEN(0)));
      }
    }
    return traffic_class;
  }

 private:
  sockaddr* name() {
    return family_ == AF_INET ? reinterpret_cast<sockaddr*>(&v4_) : reinterpret_cast<sockaddr*>(&v6_);
  }
  socklen_t size() const { return family_ == AF_INET ? sizeof v4_ : sizeof v6_; }

  int fd_;
  int family_;
  sockaddr_in v4_{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
  sockaddr_in6 v6_{.sin6_family = AF_INET6,
                   .sin6_port = 0,
                   .sin6_flowinfo = 0,
                   .sin6_addr = IN6ADDR_LOOPBACK_INIT,
                   .sin6_scope_id = 0};
};

}  // namespace tendon
