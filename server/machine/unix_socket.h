// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "protocol/link.h"

namespace tendon {

/// A datagram socket for engines on the same machine. Access is controlled by the permissions of its file.
///
/// The file is owned by the user and group of this process, and its mode is 0660. A peer is identified by the 20-bit
/// name that the kernel has assigned to its socket (autobind, see unix(7)). The name is mapped to an address from
/// 127.240.0.0 to 127.255.255.255 with port 0, which cannot be the source of a datagram from the network. Peers in
/// other network namespaces, for example in a container, cannot receive replies.
/// Thread-safe: no. Realtime-safe: no (system calls).
class UnixSocket {
 public:
  static constexpr std::size_t kMostPath = 107;  ///< bytes, limited by sockaddr_un

  /// Creates the file, or replaces the file of a server that has exited. Throws std::runtime_error if another server
  /// uses the file, if it is not a socket, if the path is too long, or if the system refuses, for example "cannot
  /// listen on unix:/run/x: Permission denied".
  explicit UnixSocket(std::filesystem::path path);
  ~UnixSocket();  ///< removes the file unless it was replaced by another process
  UnixSocket(const UnixSocket&) = delete;
  UnixSocket& operator=(const UnixSocket&) = delete;

  static bool is_peer(const Address& address) noexcept;

  /// Returns false if it was dropped: the peer is gone, or its queue is full (10 by default, net.unix.max_dgram_qlen).
  bool send(const Address& to, std::span<const std::byte> datagram) noexcept;

  /// Skips empty datagrams and datagrams from unnamed sockets. `stamp` is set if the kernel provides one.
  std::size_t receive(Address& from, std::span<std::byte> buffer, std::optional<Duration>& stamp) noexcept;

  int fd() const noexcept { return fd_; }

 private:
  struct Inode {
    std::uint64_t device = 0;
    std::uint64_t number = 0;
    bool operator==(const Inode&) const = default;
  };
  static std::optional<Inode> inode_of(const std::filesystem::path& path);
  void bind_to_file();

  std::filesystem::path path_;
  std::optional<Inode> inode_;
  int fd_ = -1;
};

}  // namespace tendon
