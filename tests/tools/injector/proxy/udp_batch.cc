// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/udp_batch.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "server/machine/local_address.h"
#include "tests/tools/injector/proxy/real_time.h"

namespace tendon::injector {
namespace {

/// A virtual machine can pause for 40 ms: 4000 datagrams at 100 000 per second, each about 1 kB in the kernel.
constexpr int kReceiveBufferBytes = 4 << 20;

constexpr std::size_t kLargestDatagram = 65'536;

/// Buffers at multiples of 64 kB would map to the same few cache sets.
constexpr std::size_t kStride = kLargestDatagram + 5 * 64;

/// SCM_TIMESTAMPNS, SO_RXQ_OVFL, and the local address.
constexpr std::size_t kControlBytes =
    CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t)) + local_address::kControlBytes;

/// An older arrival time means that the real-time clock was set.
constexpr Duration kOldestArrival = std::chrono::seconds(1);

socklen_t to_system(const Address& address, sockaddr_storage& storage) noexcept {
  if (is_ipv4(address)) {
    sockaddr_in v4{};
    v4.sin_family = AF_INET;
    v4.sin_port = htons(address.port);
    std::memcpy(&v4.sin_addr, address.ip.data() + kMappedIpv4.size(), sizeof v4.sin_addr);
    std::memcpy(&storage, &v4, sizeof v4);
    return sizeof v4;
  }
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(address.port);
  std::memcpy(&v6.sin6_addr, address.ip.data(), sizeof v6.sin6_addr);
  std::memcpy(&storage, &v6, sizeof v6);
  return sizeof v6;
}

Address from_system(const sockaddr_storage& storage) noexcept {
  Address address;
  if (storage.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &storage, sizeof v4);
    std::copy(kMappedIpv4.begin(), kMappedIpv4.end(), address.ip.begin());
    std::memcpy(address.ip.data() + kMappedIpv4.size(), &v4.sin_addr, sizeof v4.sin_addr);
    address.port = ntohs(v4.sin_port);
    return address;
  }
  sockaddr_in6 v6{};
  std::memcpy(&v6, &storage, sizeof v6);
  std::memcpy(address.ip.data(), &v6.sin6_addr, sizeof v6.sin6_addr);
  address.port = ntohs(v6.sin6_port);
  return address;
}

void set_option(int fd, int level, int name, int value) noexcept { setsockopt(fd, level, name, &value, sizeof value); }

bool is_unspecified(const Address& address) noexcept {
  const auto begin = address.ip.begin() + (is_ipv4(address) ? kMappedIpv4.size() : 0);
  return std::all_of(begin, address.ip.end(), [](std::uint8_t byte) { return byte == 0; });
}

}  // namespace

struct UdpBatch::Inbox::Memory {
  std::vector<std::byte> bytes = std::vector<std::byte>(kStride * kUdpBatch);
  struct Control {
    alignas(cmsghdr) std::array<char, kControlBytes> bytes;
  };
  std::array<Control, kUdpBatch> control{};
  std::array<sockaddr_storage, kUdpBatch> from{};
  std::array<iovec, kUdpBatch> pieces{};
  std::array<mmsghdr, kUdpBatch> messages{};
  std::array<Arrival, kUdpBatch> arrivals{};
};

UdpBatch::Inbox::Inbox() : memory_(std::make_unique<Memory>()) {
  for (std::size_t i = 0; i < kUdpBatch; ++i) {
    memory_->pieces[i] = {memory_->bytes.data() + i * kStride, kLargestDatagram};
    memory_->messages[i].msg_hdr.msg_iov = &memory_->pieces[i];
    memory_->messages[i].msg_hdr.msg_iovlen = 1;
  }
}

UdpBatch::Inbox::~Inbox() = default;

UdpBatch UdpBatch::listening(const Address& address) { return {address, &address, nullptr}; }

UdpBatch UdpBatch::connected(const Address& server) { return {server, nullptr, &server}; }

UdpBatch::UdpBatch(const Address& family, const Address* bind_to, const Address* connect_to)
    : fd_(::socket(is_ipv4(family) ? AF_INET : AF_INET6, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)),
      connected_(connect_to != nullptr),
      on_all_addresses_(bind_to != nullptr && is_unspecified(*bind_to)) {
  if (fd_ >= 0) {
    // SO_RCVBUFFORCE exceeds net.core.rmem_max but needs CAP_NET_ADMIN.
    const int wanted = kReceiveBufferBytes;
    if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0) {
      set_option(fd_, SOL_SOCKET, SO_RCVBUF, wanted);
    }
    set_option(fd_, SOL_SOCKET, SO_TIMESTAMPNS, 1);
    set_option(fd_, SOL_SOCKET, SO_RXQ_OVFL, 1);
    if (!is_ipv4(family)) set_option(fd_, IPPROTO_IPV6, IPV6_V6ONLY, on_all_addresses_ ? 0 : 1);
    sockaddr_storage storage{};
    const socklen_t size = to_system(family, storage);
    const auto* const name = reinterpret_cast<const sockaddr*>(&storage);
    const bool asks = !on_all_addresses_ || local_address::ask(fd_, is_ipv4(family) ? AF_INET : AF_INET6);
    if ((bind_to != nullptr && asks && ::bind(fd_, name, size) == 0) ||
        (connect_to != nullptr && ::connect(fd_, name, size) == 0)) {
      return;
    }
  }
  const std::string why = std::generic_category().message(errno);
  if (fd_ >= 0) ::close(fd_);
  throw std::runtime_error((bind_to != nullptr ? "cannot listen on " : "cannot send to ") + to_string(family) + ": " +
                           why);
}

UdpBatch::UdpBatch(UdpBatch&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      connected_(other.connected_),
      on_all_addresses_(other.on_all_addresses_),
      overflowed_(other.overflowed_) {}

UdpBatch& UdpBatch::operator=(UdpBatch&& other) noexcept {
  std::swap(fd_, other.fd_);
  connected_ = other.connected_;
  on_all_addresses_ = other.on_all_addresses_;
  overflowed_ = other.overflowed_;
  return *this;
}

UdpBatch::~UdpBatch() {
  if (fd_ >= 0) ::close(fd_);
}

std::span<const UdpBatch::Arrival> UdpBatch::receive(Inbox& inbox) {
  auto& m = *inbox.memory_;
  for (std::size_t i = 0; i < kUdpBatch; ++i) {
    msghdr& header = m.messages[i].msg_hdr;
    header.msg_name = connected_ ? nullptr : &m.from[i];
    header.msg_namelen = connected_ ? 0 : sizeof m.from[i];
    header.msg_control = m.control[i].bytes.data();
    header.msg_controllen = kControlBytes;
  }
  int got = -1;
  do {
    got = ::recvmmsg(fd_, m.messages.data(), kUdpBatch, MSG_DONTWAIT, nullptr);
    // An earlier datagram reached a closed port of the server.
  } while (got < 0 && (errno == EINTR || errno == ECONNREFUSED));
  if (got <= 0) return {};

  const auto [now, unix_offset] = read_both_clocks();
  const auto count = static_cast<std::size_t>(got);
  for (std::size_t i = 0; i < count; ++i) {
    msghdr& header = m.messages[i].msg_hdr;
    Arrival& arrival = m.arrivals[i];
    if (!connected_) arrival.from = from_system(m.from[i]);
    arrival.asked_at = {};
    arrival.at = now;
    arrival.datagram = {m.bytes.data() + i * kStride, m.messages[i].msg_len};
    for (cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr; control = CMSG_NXTHDR(&header, control)) {
      if (on_all_addresses_ && local_address::read(*control, arrival.asked_at.ip)) continue;
      if (control->cmsg_level != SOL_SOCKET) continue;
      if (control->cmsg_type == SCM_TIMESTAMPNS) {
        timespec stamp{};
        std::memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
        const LocalTime at(std::chrono::seconds(stamp.tv_sec) + Duration(stamp.tv_nsec) - unix_offset);
        if (at >= now - kOldestArrival) arrival.at = std::min(at, now);
      } else if (control->cmsg_type == SO_RXQ_OVFL) {
        std::memcpy(&overflowed_, CMSG_DATA(control), sizeof overflowed_);
      }
    }
  }
  return std::span(m.arrivals).first(count);
}

std::bitset<kUdpBatch> UdpBatch::send(std::span<const Outgoing> batch) {
  std::array<mmsghdr, kUdpBatch> messages;
  std::array<iovec, kUdpBatch> pieces;
  std::array<sockaddr_storage, kUdpBatch> to;
  struct Control {
    alignas(cmsghdr) std::array<char, local_address::kControlBytes> bytes;
  };
  std::array<Control, kUdpBatch> control;  // uninitialized; written before use
  const std::size_t count = std::min(batch.size(), kUdpBatch);
  for (std::size_t i = 0; i < count; ++i) {
    // sendmmsg does not write through the pointer.
    pieces[i] = {const_cast<std::byte*>(batch[i].datagram.data()), batch[i].datagram.size()};
    messages[i] = {};
    messages[i].msg_hdr.msg_iov = &pieces[i];
    messages[i].msg_hdr.msg_iovlen = 1;
    if (connected_) continue;
    messages[i].msg_hdr.msg_namelen = to_system(batch[i].to, to[i]);
    messages[i].msg_hdr.msg_name = &to[i];
    if (!on_all_addresses_ || is_unspecified(batch[i].from)) continue;
    messages[i].msg_hdr.msg_control = control[i].bytes.data();
    messages[i].msg_hdr.msg_controllen = local_address::kControlBytes;
    local_address::write(batch[i].from.ip, messages[i].msg_hdr);
  }
  std::bitset<kUdpBatch> refused;
  bool told = false;
  for (std::size_t next = 0; next < count;) {
    const int sent = ::sendmmsg(fd_, &messages[next], static_cast<unsigned>(count - next), MSG_DONTWAIT);
    if (sent > 0) {
      next += static_cast<std::size_t>(sent);
      told = false;
    } else if (errno == ECONNREFUSED && !told) {
      told = true;  // the error belongs to an earlier datagram; this one has not been tried yet
    } else if (errno != EINTR) {
      refused.set(next++);
      told = false;
    }
  }
  return refused;
}

Address UdpBatch::local_address() const {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  getsockname(fd_, reinterpret_cast<sockaddr*>(&storage), &size);
  return from_system(storage);
}

}  // namespace tendon::injector
