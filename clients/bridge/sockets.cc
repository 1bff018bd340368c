// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/sockets.h"

#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>

namespace tendon::bridge {
namespace {

constexpr int kBacklog = 16;
constexpr int kKeepAliveS = 2;  ///< s, the interval of keep-alive packets
constexpr int kKeepAlives = 3;  ///< the number of packets before the connection is closed

void set(int socket, int level, int option, int value) { ::setsockopt(socket, level, option, &value, sizeof value); }

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

std::string words_of(int error) { return std::generic_category().message(error); }

sockaddr_in socket_address(const Address& address) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  std::copy_n(address.ip.begin() + kMappedIpv4.size(), 4, reinterpret_cast<std::uint8_t*>(&result.sin_addr));
  return result;
}

Address address_of(const sockaddr_in& address) {
  Address result;
  std::ranges::copy(kMappedIpv4, result.ip.begin());
  std::copy_n(reinterpret_cast<const std::uint8_t*>(&address.sin_addr), 4, result.ip.begin() + kMappedIpv4.size());
  result.port = ntohs(address.sin_port);
  return result;
}

Address local_address(int socket) {
  sockaddr_in name{};
  socklen_t size = sizeof name;
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size);
  return address_of(name);
}

Descriptor new_socket(int kind) { return Descriptor(::socket(AF_INET, kind | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)); }

bool bind_to(int socket, const Address& address) {
  const sockaddr_in name = socket_address(address);
  return ::bind(socket, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
}

Descriptor new_listener(const Address& address) {
  Descriptor socket = new_socket(SOCK_STREAM);
  if (!socket) return {};
  set(socket.number(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (!bind_to(socket.number(), address) || ::listen(socket.number(), kBacklog) != 0) return {};
  return socket;
}

Descriptor accept_next(int listener, Address& from) {
  sockaddr_in name{};
  socklen_t size = sizeof name;
  Descriptor socket(::accept4(listener, reinterpret_cast<sockaddr*>(&name), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  from = address_of(name);
  return socket;
}

void set_up_stream(int socket, std::size_t unread) {
  set(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set(socket, SOL_SOCKET, SO_SNDBUF, static_cast<int>(unread));
  set(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(socket, IPPROTO_TCP, TCP_KEEPIDLE, kKeepAliveS);
  set(socket, IPPROTO_TCP, TCP_KEEPINTVL, kKeepAliveS);
  set(socket, IPPROTO_TCP, TCP_KEEPCNT, kKeepAlives);
  // Keep-alives are not sent while data is not acknowledged.
  set(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, kKeepAliveS * (1 + kKeepAlives) * 1000);  // ms
}

}  // namespace tendon::bridge
