// SPDX-License-Identifier: Apache-2.0
#include "server/machine/unix_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "clients/cpp/kernel_stamps.h"

namespace tendon {
namespace {

constexpr int kMaxSkips = 64;  ///< limits the time in receive() during a flood

constexpr std::size_t kNameStart = offsetof(sockaddr_un, sun_path);
constexpr std::size_t kDigits = 5;  ///< hexadecimal, after a null byte; see unix_autobind() in net/unix/af_unix.c
constexpr std::size_t kNameBytes = kNameStart + 1 + kDigits;

/// The prefix of all addresses that represent peers. Only the first 12 bits of the IPv4 address are used.
constexpr std::array<std::uint8_t, 14> kPeers = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 240};

std::optional<Address> address_of(const sockaddr_un& name, socklen_t length) {
  if (length != kNameBytes || name.sun_path[0] != '\0') return std::nullopt;
  std::uint32_t number = 0;
  const char* const end = name.sun_path + 1 + kDigits;
  const auto [stop, error] = std::from_chars(name.sun_path + 1, end, number, 16);
  if (error != std::errc{} || stop != end) return std::nullopt;
  Address address;
  std::copy(kPeers.begin(), kPeers.end(), address.ip.begin());
  address.ip[13] = static_cast<std::uint8_t>(address.ip[13] | number >> 16U);
  address.ip[14] = static_cast<std::uint8_t>(number >> 8U & 0xffU);
  address.ip[15] = static_cast<std::uint8_t>(number & 0xffU);
  return address;
}

sockaddr_un name_of(const Address& address) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  const std::uint32_t number = (address.ip[13] & 0x0fU) << 16U | static_cast<std::uint32_t>(address.ip[14]) << 8U |
                               static_cast<std::uint32_t>(address.ip[15]);
  for (std::size_t i = 0; i < kDigits; ++i) {
    name.sun_path[1 + i] = "0123456789abcdef"[number >> 4 * (kDigits - 1 - i) & 0xfU];
  }
  return name;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw std::runtime_error("cannot listen on unix:" + path.string() + ": " + why);
}

std::string reason() { return std::system_category().message(errno); }

sockaddr_un file_name(const std::filesystem::path& path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  const std::string& text = path.native();
  static_assert(UnixSocket::kMostPath == sizeof name.sun_path - 1);
  if (text.empty() || text.size() > UnixSocket::kMostPath) {
    refuse(path, "expected a path of 1 to " + std::to_string(UnixSocket::kMostPath) + " bytes, found " +
                     std::to_string(text.size()));
  }
  std::copy(text.begin(), text.end(), name.sun_path);
  return name;
}

const sockaddr* as_address(const sockaddr_un& name) { return reinterpret_cast<const sockaddr*>(&name); }

}  // namespace

std::optional<UnixSocket::Inode> UnixSocket::inode_of(const std::filesystem::path& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return std::nullopt;
  return Inode{found.st_dev, found.st_ino};
}

UnixSocket::UnixSocket(std::filesystem::path path) : path_(std::move(path)) {
  static_cast<void>(file_name(path_));
  fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) refuse(path_, reason());
  try {
    bind_to_file();
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

void UnixSocket::bind_to_file() {
  const sockaddr_un name = file_name(path_);
  struct stat found {};
  if (::lstat(path_.c_str(), &found) == 0) {
    if (!S_ISSOCK(found.st_mode)) refuse(path_, "the file exists and is not a socket; it was not changed");
    if (::connect(fd_, as_address(name), sizeof name) == 0) refuse(path_, "another server is already listening there");
    // No process is listening, so a server that was killed has left the file behind.
    if (errno != ECONNREFUSED || ::unlink(path_.c_str()) != 0) refuse(path_, reason());
  }
  // Other users must not be able to write to the file, not even for a short time.
  const mode_t before = ::umask(S_IXUSR | S_IXGRP | S_IRWXO);
  const int bound = ::bind(fd_, as_address(name), sizeof name);
  const std::string why = bound == 0 ? "" : reason();
  ::umask(before);
  if (bound != 0) refuse(path_, why);
  inode_ = inode_of(path_);
}

UnixSocket::~UnixSocket() {
  if (inode_ && inode_of(path_) == inode_) ::unlink(path_.c_str());
  ::close(fd_);
}

bool UnixSocket::is_peer(const Address& address) noexcept {
  return address.port == 0 && std::equal(kPeers.begin(), kPeers.end() - 1, address.ip.begin()) &&
         (address.ip[13] & 0xf0U) == kPeers[13];
}

bool UnixSocket::send(const Address& to, std::span<const std::byte> datagram) noexcept {
  const sockaddr_un name = name_of(to);
  return ::sendto(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL, as_address(name), kNameBytes) >= 0;
}

std::size_t UnixSocket::receive(Address& from, std::span<std::byte> buffer, std::optional<Duration>& stamp) noexcept {
  for (int i = 0; i < kMaxSkips; ++i) {
    sockaddr_un name{};
    iovec piece{buffer.data(), buffer.size()};
    alignas(cmsghdr) std::array<char, KernelStamps::kControlBytes> control;
    msghdr header{};
    header.msg_name = &name;
    header.msg_namelen = sizeof name;
    header.msg_iov = &piece;
    header.msg_iovlen = 1;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(fd_, &header, MSG_TRUNC);
    if (size < 0 && errno != EINTR) return 0;
    if (size <= 0) continue;
    const auto address = address_of(name, header.msg_namelen);
    if (!address) continue;
    stamp = KernelStamps::find(header);
    from = *address;
    return static_cast<std::size_t>(size);
  }
  return 0;
}

}  // namespace tendon
