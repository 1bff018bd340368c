// SPDX-License-Identifier: Apache-2.0
#include "server/machine/udp_link.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <asio/ip/v6_only.hpp>
#include <cerrno>
#include <ctime>
#include <stdexcept>

#include "server/machine/clock.h"

namespace tendon {
namespace {

using asio::ip::udp;

/// Size of the kernel's buffer for datagrams that nobody has read yet. The virtual machines we tested
/// on pause for up to 36 ms; ten clients at 1 kHz send 360 datagrams in that time, and the kernel
/// books up to 2.3 kB for each. The system grants at most net.core.rmem_max, without an error.
constexpr int kReceiveBufferBytes = 1 << 20;

/// Empty datagrams skipped by one receive(): a flood of them must not keep us from sending.
constexpr int kMaxEmptyDatagrams = 64;

udp::endpoint to_endpoint(const Address& address) {
  const asio::ip::address_v6 v6(address.ip);
  if (v6.is_v4_mapped()) return {asio::ip::make_address_v4(asio::ip::v4_mapped, v6), address.port};
  return {v6, address.port};
}

Address to_address(const udp::endpoint& endpoint) {
  const asio::ip::address address = endpoint.address();
  const asio::ip::address_v6 v6 =
      address.is_v4() ? asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4()) : address.to_v6();
  return {v6.to_bytes(), endpoint.port()};
}

}  // namespace

struct UdpLink::Socket {
  asio::io_context context;
  asio::ip::udp::socket udp{context};
};

UdpLink::UdpLink(const Address& listen, Reach reach, const std::optional<std::filesystem::path>& file)
    : socket_(std::make_unique<Socket>()) {
  if (reach == Reach::kThisMachine && !is_loopback(listen)) {
    throw std::invalid_argument("refusing to listen on " + to_string(listen) +
                                ": there are no keys, so anyone on the network could command forces; use a loopback "
                                "address (127.0.0.1 or [::1]), or give each client a key (`tendond keygen NAME`, and "
                                "`keys` in the scene's [network])");
  }
  const udp::endpoint endpoint = to_endpoint(listen);
  try {
    socket_->udp.open(endpoint.protocol());
    if (endpoint.protocol() == udp::v6()) socket_->udp.set_option(asio::ip::v6_only(true));
    socket_->udp.set_option(asio::socket_base::receive_buffer_size(kReceiveBufferBytes));
    socket_->udp.non_blocking(true);
    socket_->udp.bind(endpoint);
  } catch (const std::system_error& error) {
    throw std::runtime_error("cannot listen on " + to_string(listen) + ": " + error.code().message());
  }
  if (file) unix_.emplace(*file);
}

UdpLink::~UdpLink() = default;

void UdpLink::send(const Address& to, std::span<const std::byte> datagram) {
  if (unix_ && UnixSocket::is_peer(to)) {
    if (!unix_->send(to, datagram)) send_failures_.add();
    return;
  }
  asio::error_code error;
  socket_->udp.send_to(asio::buffer(datagram.data(), datagram.size()), to_endpoint(to), 0, error);
  if (error) send_failures_.add();
}

std::size_t UdpLink::receive(Address& from, std::span<std::byte> buffer) {
  if (!unix_) return receive_from_network(from, buffer);
  unix_first_ = !unix_first_;
  const std::size_t size = unix_first_ ? unix_->receive(from, buffer) : receive_from_network(from, buffer);
  if (size != 0) return size;
  return unix_first_ ? receive_from_network(from, buffer) : unix_->receive(from, buffer);
}

std::size_t UdpLink::receive_from_network(Address& from, std::span<std::byte> buffer) {
  // Asio cannot tell the full size of a truncated datagram, so this calls the system directly.
  udp::endpoint endpoint;
  for (int i = 0; i < kMaxEmptyDatagrams; ++i) {
    auto length = static_cast<socklen_t>(endpoint.capacity());
    const ssize_t size =
        ::recvfrom(fd(), buffer.data(), buffer.size(), MSG_TRUNC | MSG_DONTWAIT, endpoint.data(), &length);
    if (size == 0 || (size < 0 && errno == EINTR)) continue;
    if (size < 0) return 0;
    endpoint.resize(length);
    from = to_address(endpoint);
    if (UnixSocket::is_peer(from)) continue;  // no port is 0, unless somebody makes it up
    return static_cast<std::size_t>(size);
  }
  return 0;
}

LocalTime UdpLink::present(LocalTime now) const { return std::max(now, clock::now()); }

void UdpLink::wait(Duration timeout, Doorbell* doorbell) {
  // poll() ignores an entry with a negative descriptor.
  std::array<pollfd, 3> fds = {pollfd{fd(), POLLIN, 0}, pollfd{doorbell != nullptr ? doorbell->fd() : -1, POLLIN, 0},
                               pollfd{unix_ ? unix_->fd() : -1, POLLIN, 0}};
  const Duration left = std::max(timeout, Duration::zero());
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec time{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
  const int ready = ::ppoll(fds.data(), fds.size(), &time, nullptr);
  if (ready > 0 && fds[1].revents != 0) doorbell->answer();
}

Address UdpLink::local_address() const { return to_address(socket_->udp.local_endpoint()); }

int UdpLink::fd() const noexcept { return socket_->udp.native_handle(); }

}  // namespace tendon
