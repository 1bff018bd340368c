// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/udp_transport.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <asio/local/datagram_protocol.hpp>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/cpp/machine.h"

namespace tendon {
namespace {

using asio::ip::udp;

/// The maximum number of empty datagrams and errors (ICMP "port unreachable" while no server is running) that one
/// receive() skips, so that a flood cannot prevent sending.
constexpr int kMaxSkips = 64;

udp::endpoint to_endpoint(const Address& address) {
  const asio::ip::address_v6 v6(address.ip);
  if (v6.is_v4_mapped()) return {asio::ip::make_address_v4(asio::ip::v4_mapped, v6), address.port};
  return {v6, address.port};
}

/// Receives a datagram and, if `stamp` is not null, its time stamp. MSG_TRUNC: returns the size of the datagram even if
/// the buffer is smaller.
ssize_t take(int fd, std::span<std::byte> buffer, std::optional<Duration>* stamp) noexcept {
  if (stamp == nullptr) return ::recv(fd, buffer.data(), buffer.size(), MSG_TRUNC);
  iovec piece{buffer.data(), buffer.size()};
  alignas(cmsghdr) std::array<char, KernelStamps::kControlBytes> control;
  msghdr header{};
  header.msg_iov = &piece;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  const ssize_t size = ::recvmsg(fd, &header, MSG_TRUNC);
  if (size > 0) *stamp = KernelStamps::find(header);
  return size;
}

/// Returns whether one of the descriptors is readable.
bool poll_until_readable(std::span<pollfd> descriptors, Duration timeout) noexcept {
  const Duration left = std::max(timeout, Duration::zero());
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec time{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
  return ::ppoll(descriptors.data(), descriptors.size(), &time, nullptr) > 0;
}

}  // namespace

/// Replaces the socket, released from Asio, whose epoll instance every datagram would signal without need.
void UdpTransport::use(int connected) noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = connected;
  stamped_ = false;
}

void UdpTransport::ask_for_stamps() noexcept {
  if (!std::exchange(stamped_, true)) KernelStamps::ask(fd_);
}

/// Binds to an address chosen by the kernel (unix(7), autobind), so that the server can answer.
void UdpTransport::connect_to_file() {
  const asio::local::datagram_protocol::endpoint file(name_.unix_path());
  try {
    asio::io_context context;
    asio::local::datagram_protocol::socket socket(context, file.protocol());
    const sockaddr unnamed{.sa_family = AF_UNIX, .sa_data = {}};
    if (::bind(socket.native_handle(), &unnamed, sizeof unnamed.sa_family) != 0) {
      throw std::system_error(errno, std::system_category());
    }
    socket.connect(file);
    socket.non_blocking(true);
    use(socket.release());
  } catch (const std::system_error& error) {
    throw std::runtime_error("cannot reach " + name_.text() + ": " + error.code().message());
  }
}

UdpTransport::UdpTransport(const ServerName& server, bool has_key, std::optional<Dscp> dscp)
    : name_(server), has_key_(has_key), dscp_(dscp) {
  ServerName::Place place = name_.look_up(has_key_);
  connect(place.addresses, 0);
  device_ = std::move(place.device);
}

UdpTransport::~UdpTransport() { use(-1); }

void UdpTransport::connect(const std::vector<Address>& addresses, std::size_t first) {
  if (!name_.unix_path().empty()) {
    connect_to_file();
    server_ = addresses.front();
    return;
  }
  std::string problem;
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    const Address& address = addresses[(first + i) % addresses.size()];
    try {
      asio::io_context context;
      const udp::endpoint endpoint = to_endpoint(address);
      udp::socket socket(context, endpoint.protocol());
      if (dscp_ && !mark(socket.native_handle(), *dscp_)) throw std::system_error(errno, std::system_category());
      socket.connect(endpoint);
      socket.non_blocking(true);
      use(socket.release());
      server_ = address;
      return;
    } catch (const std::system_error& error) {
      if (problem.empty()) problem = "cannot reach " + name_.at(address) + ": " + error.code().message();
    }
  }
  throw std::runtime_error(problem);
}

void UdpTransport::look_up_again(bool another) {
  const std::vector<Address> addresses = name_.look_up(has_key_).addresses;
  const auto present = std::find(addresses.begin(), addresses.end(), server_);
  const bool stays = name_.unix_path().empty() && present != addresses.end();
  if (stays && (!another || addresses.size() == 1)) return;
  connect(addresses, present == addresses.end() ? 0 : static_cast<std::size_t>(present - addresses.begin()) + 1);
}

void UdpTransport::send(const Address& to, std::span<const std::byte> datagram) {
  if (to != server_) return;
  [[maybe_unused]] const ssize_t sent = ::send(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL);
}

std::size_t UdpTransport::receive(Address& from, std::span<std::byte> buffer) {
  from = server_;
  for (int i = 0; i < kMaxSkips; ++i) {
    std::optional<Duration> stamp;
    const ssize_t size = take(fd_, buffer, stamped_ ? &stamp : nullptr);
    if (size > 0) {
      if (stamp) {
        const Duration unix_now = read_unix_clock();
        stamps_.observe(*stamp, unix_now, read_clock());
      } else {
        stamps_.observe(read_clock());
      }
      return static_cast<std::size_t>(size);
    }
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
  }
  return 0;
}

LocalTime UdpTransport::present(LocalTime now) const { return std::max(now, read_clock()); }

void UdpTransport::wait(Duration timeout) {
  ask_for_stamps();
  pollfd alone{fd_, POLLIN, 0};
  poll_until_readable({&alone, 1}, timeout);
}

bool UdpTransport::wait_for_any(std::span<UdpTransport* const> transports, Duration timeout, int also) {
  std::vector<pollfd> readable;
  if (also >= 0) readable.push_back({also, POLLIN, 0});
  for (UdpTransport* const transport : transports) {
    transport->ask_for_stamps();
    readable.push_back({transport->descriptor(), POLLIN, 0});
  }
  return poll_until_readable(readable, timeout);
}

}  // namespace tendon
