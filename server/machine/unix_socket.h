// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "protocol/link.h"

namespace tendon {

/// A datagram socket that engines on the same machine reach by a file: who may write to the file may come in.
///
/// The file belongs to the user and group of this process, and only these two may use it (mode 0660). A peer is known
/// by the name that the kernel has given its socket (unix(7), autobind: 20 bits), and stands for an Address that no
/// datagram of a network can come from: 127.240.0.0 to 127.255.255.255, port 0. A peer in another network namespace (a
/// container) has its name there, where no answer reaches it.
///
/// Thread-safe: no. Realtime-safe: no (system calls).
class UnixSocket {
 public:
  static constexpr std::size_t kMostPath = 107;  ///< bytes; the system has room for no more

  /// Makes the file. One that a server has left behind when it died is replaced. Throws std::runtime_error when there
  /// is a server behind the file, when it is no socket (it stays as it is), when the path has more than 107 bytes, or
  /// with the system's reason: "cannot listen on unix:/run/x: Permission denied".
  explicit UnixSocket(std::filesystem::path path);
  /// Takes the file away, unless it is another's by now.
  ~UnixSocket();
  UnixSocket(const UnixSocket&) = delete;
  UnixSocket& operator=(const UnixSocket&) = delete;

  /// Whether this address stands for a peer of such a socket.
  static bool is_peer(const Address& address) noexcept;

  /// False when the datagram is lost: nobody has that name, or ten datagrams wait there (net.unix.max_dgram_qlen).
  bool send(const Address& to, std::span<const std::byte> datagram) noexcept;

  /// As Link says. A datagram that is empty, or whose sender has no name, is skipped.
  std::size_t receive(Address& from, std::span<std::byte> buffer) noexcept;

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
  std::optional<Inode> inode_;  ///< of the file, when it has been made
  int fd_ = -1;
};

}  // namespace tendon
