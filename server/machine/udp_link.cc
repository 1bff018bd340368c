// SPDX-License-Identifier: Apache-2.0
#include "server/machine/udp_link.h"

#include <linux/filter.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <asio/ip/v6_only.hpp>
#include <cerrno>
#include <ctime>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "protocol/wire/header.h"
#include "server/machine/clock.h"
#include "server/machine/local_address.h"

namespace tendon {
namespace {

using asio::ip::udp;

/// Bytes. Virtual machines pause for up to 36 ms in our tests. In this time, 10 clients at 1 kHz send 360 datagrams,
/// which require up to 2.3 kB each in the kernel. The size is silently limited to net.core.rmem_max.
constexpr int kReceiveBufferBytes = 1 << 20;

constexpr int kMaxEmptyDatagrams = 64;  ///< limits the time in receive() during a flood

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

template <class Value>
void set(int fd, int option, const Value& value, int level = SOL_SOCKET) {
  if (::setsockopt(fd, level, option, &value, sizeof value) != 0) {
    throw std::system_error(errno, std::generic_category());
  }
}

struct Message {
  Message(std::span<const std::byte> datagram, udp::endpoint& peer, std::size_t peer_size)
      : piece_{const_cast<std::byte*>(datagram.data()), datagram.size()} {  // not modified by sendmsg
    header.msg_name = peer.data();
    header.msg_namelen = static_cast<socklen_t>(peer_size);
    header.msg_iov = &piece_;
    header.msg_iovlen = 1;
  }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;

  void ask_for_control() noexcept {
    header.msg_control = control_.data();
    header.msg_controllen = control_.size();
  }

  std::optional<AskedAt::Ip> local() noexcept {
    AskedAt::Ip ip{};
    for (cmsghdr* said = CMSG_FIRSTHDR(&header); said != nullptr; said = CMSG_NXTHDR(&header, said)) {
      if (local_address::read(*said, ip)) return ip;
    }
    return std::nullopt;
  }

  void leave_from(const AskedAt::Ip& local) noexcept {
    ask_for_control();
    local_address::write(local, header);
  }

  void leave_from_any() noexcept {
    header.msg_control = nullptr;
    header.msg_controllen = 0;
  }

  msghdr header{};

 private:
  iovec piece_;
  alignas(cmsghdr) std::array<char, local_address::kControlBytes + KernelStamps::kControlBytes> control_{};
};

/// Receives a datagram without waiting, like recvfrom(). If `local` is not null, it is set to the local address of the
/// datagram, and if `stamp` is not null, to its time stamp. This requires recvmsg(), which takes longer.
ssize_t take(int fd, std::span<std::byte> buffer, udp::endpoint& from, std::optional<AskedAt::Ip>* local,
             std::optional<Duration>* stamp) {
  if (local == nullptr && stamp == nullptr) {
    auto length = static_cast<socklen_t>(from.capacity());
    const ssize_t size = ::recvfrom(fd, buffer.data(), buffer.size(), MSG_TRUNC | MSG_DONTWAIT, from.data(), &length);
    if (size >= 0) from.resize(length);
    return size;
  }
  Message message(buffer, from, from.capacity());
  message.ask_for_control();
  const ssize_t size = ::recvmsg(fd, &message.header, MSG_TRUNC | MSG_DONTWAIT);
  if (size >= 0) {
    from.resize(message.header.msg_namelen);
    if (local != nullptr) *local = message.local();
    if (stamp != nullptr) *stamp = KernelStamps::find(message.header);
  }
  return size;
}

void share_address(int fd) { set(fd, SO_REUSEPORT, int{1}); }

/// The filter is described at UdpLink::several. For short datagrams, it returns 0, which is the first socket.
void steer_by_connection(int fd, std::uint32_t count) {
  constexpr auto kTypeBits = 0x0FU;
  std::array<sock_filter, 7> program = {{
      BPF_STMT(BPF_LD | BPF_B | BPF_ABS, kTypeByte),
      BPF_STMT(BPF_ALU | BPF_AND | BPF_K, kTypeBits),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(DatagramType::kData), 0, 3),
      BPF_STMT(BPF_LD | BPF_B | BPF_ABS, kConnectionIdByte),
      BPF_STMT(BPF_ALU | BPF_AND | BPF_K, count - 1),
      BPF_STMT(BPF_RET | BPF_A, 0),
      BPF_STMT(BPF_RET | BPF_K, 0),
  }};
  set(fd, SO_ATTACH_REUSEPORT_CBPF, sock_fprog{static_cast<unsigned short>(program.size()), program.data()});
}

/// Avoids Asio's epoll instance, which would be notified for each datagram. Throws std::system_error.
int socket_on(const udp::endpoint& endpoint, std::optional<Dscp> dscp, bool shares_address) {
  asio::io_context context;
  udp::socket socket(context, endpoint.protocol());
  const bool all = endpoint.address().is_unspecified();
  if (endpoint.protocol() == udp::v6()) socket.set_option(asio::ip::v6_only(!all));
  if (all && !local_address::ask(socket.native_handle(), endpoint.protocol().family())) {
    throw std::system_error(errno, std::generic_category());
  }
  socket.set_option(asio::socket_base::receive_buffer_size(kReceiveBufferBytes));
  socket.non_blocking(true);
  if (shares_address) share_address(socket.native_handle());
  if (dscp && !mark(socket.native_handle(), *dscp)) throw std::system_error(errno, std::generic_category());
  socket.bind(endpoint);
  return socket.release();
}

std::runtime_error cannot_listen(const Address& listen, const std::system_error& error) {
  const bool taken = error.code().value() == EADDRINUSE;
  return std::runtime_error("cannot listen on " + to_string(listen) + ": " + error.code().message() +
                            (taken ? "; use `ss -lunp` to find the program that uses it" : ""));
}

}  // namespace

UdpLink::UdpLink(const Address& listen, Reach reach, const std::optional<std::filesystem::path>& file,
                 std::optional<Dscp> dscp) {
  if (reach == Reach::kThisMachine && !is_loopback(listen)) {
    throw std::invalid_argument(
        "cannot listen on " + to_string(listen) +
        ": without keys, anyone on the network could command forces; use a loopback address (127.0.0.1 or [::1]), or "
        "create a key for each client (`tendond keygen NAME`, and `keys` in [network] of the scene)");
  }
  if (file) unix_.emplace(*file);
  if (to_endpoint(listen).address().is_unspecified()) own_asked_at_ = std::make_unique<AskedAt>();
  asked_at_ = own_asked_at_.get();
  try {
    fd_ = socket_on(to_endpoint(listen), dscp, false);
  } catch (const std::system_error& error) {
    throw cannot_listen(listen, error);
  }
}

UdpLink::UdpLink(const UdpLink& first, std::optional<Dscp> dscp, Further)
    : fd_(socket_on(to_endpoint(first.local_address()), dscp, true)), asked_at_(first.asked_at_) {}

std::vector<std::unique_ptr<UdpLink>> UdpLink::several(const Address& listen, Reach reach, std::uint32_t count,
                                                       std::optional<Dscp> dscp) {
  std::vector<std::unique_ptr<UdpLink>> links;
  links.push_back(std::make_unique<UdpLink>(listen, reach, std::nullopt, dscp));  // fails if the address is in use
  if (count == 1) return links;
  try {
    share_address(links.front()->fd_);
    while (links.size() < count)
      links.push_back(std::unique_ptr<UdpLink>(new UdpLink(*links.front(), dscp, Further{})));
    steer_by_connection(links.front()->fd_, count);
  } catch (const std::system_error& error) {
    throw cannot_listen(listen, error);
  }
  return links;
}

UdpLink::~UdpLink() { ::close(fd_); }

void UdpLink::send(const Address& to, std::span<const std::byte> datagram) {
  if (unix_ && UnixSocket::is_peer(to)) {
    if (!unix_->send(to, datagram)) send_failures_.add();
    return;
  }
  if (!send_to_network(to, datagram)) send_failures_.add();
}

bool UdpLink::send_to_network(const Address& to, std::span<const std::byte> datagram) const {
  udp::endpoint endpoint = to_endpoint(to);
  const auto local = asked_at_ ? asked_at_->find(to) : std::nullopt;
  if (!local) {
    return ::sendto(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL, endpoint.data(),
                    static_cast<socklen_t>(endpoint.size())) >= 0;
  }
  Message message(datagram, endpoint, endpoint.size());
  message.leave_from(*local);
  if (::sendmsg(fd_, &message.header, MSG_NOSIGNAL) >= 0) return true;
  // The local address may have been removed, or may be a multicast address.
  if (errno != EINVAL && errno != EADDRNOTAVAIL && errno != ENETUNREACH) return false;
  message.leave_from_any();
  return ::sendmsg(fd_, &message.header, MSG_NOSIGNAL) >= 0;
}

std::size_t UdpLink::receive(Address& from, std::span<std::byte> buffer) {
  std::optional<Duration> stamp;
  const auto receive_from = [&](bool file) {
    return file ? unix_->receive(from, buffer, stamp) : receive_from_network(from, buffer, stamp);
  };
  if (unix_) unix_first_ = !unix_first_;
  std::size_t size = receive_from(unix_first_);
  if (size == 0 && unix_) size = receive_from(!unix_first_);
  if (size == 0) return 0;
  if (stamp) {
    const Duration unix_now = clock::unix_time();
    stamps_.observe(*stamp, unix_now, clock::now());
  } else {
    stamps_.observe(clock::now());
  }
  return size;
}

std::size_t UdpLink::receive_from_network(Address& from, std::span<std::byte> buffer, std::optional<Duration>& stamp) {
  udp::endpoint endpoint;
  for (int i = 0; i < kMaxEmptyDatagrams; ++i) {
    std::optional<AskedAt::Ip> local;
    const ssize_t size = take(fd_, buffer, endpoint, asked_at_ ? &local : nullptr, stamped_ ? &stamp : nullptr);
    if (size == 0 || (size < 0 && errno == EINTR)) continue;
    if (size < 0) return 0;
    from = to_address(endpoint);
    if (UnixSocket::is_peer(from)) continue;  // spoofed: port 0 is not valid
    if (local) asked_at_->put(from, *local);
    return static_cast<std::size_t>(size);
  }
  return 0;
}

LocalTime UdpLink::present(LocalTime now) const { return std::max(now, clock::now()); }

void UdpLink::wait(Duration timeout, Doorbell* doorbell) {
  if (!std::exchange(stamped_, true)) {
    KernelStamps::ask(fd_);
    if (unix_) KernelStamps::ask(unix_->fd());
  }
  // Entries with a negative descriptor are ignored by poll().
  std::array<pollfd, 3> fds = {pollfd{fd_, POLLIN, 0}, pollfd{doorbell != nullptr ? doorbell->fd() : -1, POLLIN, 0},
                               pollfd{unix_ ? unix_->fd() : -1, POLLIN, 0}};
  const Duration left = std::max(timeout, Duration::zero());
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec time{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
  const int ready = ::ppoll(fds.data(), fds.size(), &time, nullptr);
  if (ready > 0 && fds[1].revents != 0) doorbell->answer();
}

Address UdpLink::local_address() const {
  udp::endpoint endpoint;
  auto length = static_cast<socklen_t>(endpoint.capacity());
  if (::getsockname(fd_, endpoint.data(), &length) != 0) throw std::system_error(errno, std::system_category());
  endpoint.resize(length);
  return to_address(endpoint);
}

}  // namespace tendon
