// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/peers/bare_udp.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <string>

#include "tests/tools/bench/other_process.h"

namespace tendon::bench {
namespace {

class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    if (fd_ < 0) fail("socket");
  }
  ~Socket() { ::close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int get() const noexcept { return fd_; }

 private:
  int fd_;
};

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<in_port_t>(port));
  return address;
}

class UdpClient : public EchoClient {
 public:
  explicit UdpClient(const EchoSetup& setup) {
    const sockaddr_in to = loopback(std::stoi(setup.address()));
    const timeval patience{.tv_sec = 1, .tv_usec = 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) fail("connect");
  }
  bool request_reply() override {
    return ::send(socket_.get(), request_.data(), request_.size(), 0) > 0 &&
           ::recv(socket_.get(), reply_.data(), reply_.size(), 0) == static_cast<ssize_t>(reply_.size());
  }

 private:
  Socket socket_;
  std::array<std::byte, kRequestBytes> request_{};
  std::array<std::byte, kReplyBytes> reply_{};
};

}  // namespace

void serve_udp(EchoSetup& setup) {
  const Socket socket;
  sockaddr_in own = loopback(0);
  socklen_t size = sizeof own;
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), size) != 0) fail("bind");
  if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size) != 0) fail("getsockname");
  setup.announce(std::to_string(ntohs(own.sin_port)));
  std::array<std::byte, kRequestBytes> request{};
  const std::array<std::byte, kReplyBytes> reply{};
  for (;;) {
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    if (::recvfrom(socket.get(), request.data(), request.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_size) < 0)
      fail("recvfrom");
    setup.delay_reply();
    ::sendto(socket.get(), reply.data(), reply.size(), 0, reinterpret_cast<const sockaddr*>(&from), from_size);
  }
}

std::unique_ptr<EchoClient> udp_client(EchoSetup& setup) { return std::make_unique<UdpClient>(setup); }

}  // namespace tendon::bench
