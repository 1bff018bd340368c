// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <ctime>
#include <span>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {

/// The server accepts up to 20 handshakes per second from an address, and up to 40 at the same time.
inline constexpr std::size_t kGuestsPerAddress = 16;

/// A client's connected socket, whose source address depends on its number. Reports kernel receive times.
class GuestSocket {
 public:
  GuestSocket(const Address& server, std::size_t number)
      : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    if (fd_ < 0) fail("socket");
    sockaddr_in from{};
    from.sin_family = AF_INET;
    from.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 256 + static_cast<std::uint32_t>(number / kGuestsPerAddress));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(server.port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    ::setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    const int bytes = 1 << 20;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0) fail("bind a guest");
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) fail("connect a guest");
  }
  ~GuestSocket() { ::close(fd_); }
  GuestSocket(const GuestSocket&) = delete;
  GuestSocket& operator=(const GuestSocket&) = delete;

  int fd() const { return fd_; }
  void send(std::span<const std::byte> datagram) { ::send(fd_, datagram.data(), datagram.size(), 0); }
  /// Receives a datagram and returns its size, or 0 if there is none. `at` is the receive time (Unix time).
  std::size_t receive(std::span<std::byte> buffer, Duration& at) {
    iovec piece{buffer.data(), buffer.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
    msghdr message{nullptr, 0, &piece, 1, control.data(), control.size(), 0};
    const ssize_t size = ::recvmsg(fd_, &message, 0);
    if (size <= 0) return 0;
    for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
      if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec time{};
      std::memcpy(&time, CMSG_DATA(part), sizeof time);
      at = std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
    }
    return static_cast<std::size_t>(size);
  }

 private:
  int fd_;
};

}  // namespace tendon::bench
