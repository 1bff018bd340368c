// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "clients/cpp/dscp.h"
#include "clients/cpp/kernel_stamps.h"
#include "core/base/time.h"
#include "core/exchange/counter.h"
#include "protocol/link.h"
#include "server/machine/asked_at.h"
#include "server/machine/doorbell.h"
#include "server/machine/unix_socket.h"

namespace tendon {

enum class Reach : std::uint8_t {
  kThisMachine,  ///< loopback only
  kAnywhere,     ///< requires keys
};

/// A UDP socket on one or all of the IPv4 or IPv6 addresses of this machine. If it is bound to 0.0.0.0 (IPv4) or [::]
/// (both families), it replies to a peer from the address that the peer has used. Optionally, there is also a Unix
/// socket for engines on the same machine. send() and receive() do not block.
/// Thread-safe: no. Realtime-safe: no (system calls).
class UdpLink : public Link {
 public:
  /// The system chooses a port if it is 0. Throws std::invalid_argument if `listen` is not a loopback address and
  /// `reach` does not allow this. Throws std::runtime_error if the system refuses, for example "cannot listen on
  /// 127.0.0.1:47100: Address already in use". With `file`, also creates a UnixSocket, and throws its errors. With
  /// `dscp`, all datagrams are marked.
  explicit UdpLink(const Address& listen, Reach reach = Reach::kThisMachine,
                   const std::optional<std::filesystem::path>& file = std::nullopt,
                   std::optional<Dscp> dscp = std::nullopt);

  /// Creates links that share an address, each for a separate thread. `count` must be a power of two. The kernel
  /// distributes Data datagrams based on the connection id modulo `count`, and sends all others to the first link
  /// (SO_REUSEPORT with a filter, socket(7)). Throws the same errors as the constructor.
  static std::vector<std::unique_ptr<UdpLink>> several(const Address& listen, Reach reach, std::uint32_t count,
                                                       std::optional<Dscp> dscp = std::nullopt);

  ~UdpLink() override;
  UdpLink(const UdpLink&) = delete;
  UdpLink& operator=(const UdpLink&) = delete;

  /// If the datagram cannot be sent immediately, it is dropped and counted in send_failures().
  void send(const Address& to, std::span<const std::byte> datagram) override;

  /// Alternates with the Unix socket, if any. Skips empty datagrams, because a size of 0 means that there is none.
  std::size_t receive(Address& from, std::span<std::byte> buffer) override;

  LocalTime present(LocalTime now) const override;
  LocalTime arrived(LocalTime now) const override { return std::max(now, stamps_.read()); }
  LocalTime reached(LocalTime now) const override { return std::min(now, stamps_.reached()); }

  /// Waits until a datagram can be received, the doorbell rings, or `timeout` has elapsed. Signal handlers can end it
  /// early. The doorbell is answered. The resolution is the timer slack of the thread, which is 50 µs by default. The
  /// first wait enables the time stamps of the kernel.
  void wait(Duration timeout, Doorbell* doorbell = nullptr);

  Address local_address() const;  ///< with the actual port

  /// The number of datagrams dropped by send(). Thread-safe: yes.
  std::uint64_t send_failures() const noexcept { return send_failures_.value(); }

  /// The number of time stamps of the kernel that were not used (KernelStamps). Thread-safe: yes.
  std::uint64_t refused_stamps() const noexcept { return stamps_.refused(); }

  int fd() const noexcept { return fd_; }

 private:
  struct Further {};
  UdpLink(const UdpLink& first, std::optional<Dscp> dscp, Further);
  std::size_t receive_from_network(Address& from, std::span<std::byte> buffer, std::optional<Duration>& stamp);
  bool send_to_network(const Address& to, std::span<const std::byte> datagram) const;

  int fd_ = -1;
  std::unique_ptr<AskedAt> own_asked_at_;
  AskedAt* asked_at_ = nullptr;  ///< null if bound to a single address
  std::optional<UnixSocket> unix_;
  bool unix_first_ = false;  ///< which socket is read first, to prevent starvation
  bool stamped_ = false;
  KernelStamps stamps_;
  Counter send_failures_;
};

}  // namespace tendon
