// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/control_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace tendon::injector {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
  throw std::runtime_error("--control " + path.string() + ": " + why);
}

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  fail(path, std::generic_category().message(error));
}

sockaddr_un address_of(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.size() >= sizeof address.sun_path) {
    fail(path, "expected a path shorter than " + std::to_string(sizeof address.sun_path) + " bytes");
  }
  std::copy(text.begin(), text.end(), address.sun_path);
  return address;
}

/// −1 with errno set.
int connect_to(const std::filesystem::path& path) {
  const sockaddr_un address = address_of(path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

/// Returns false if the peer has closed the connection or its buffer is full.
bool send_all(int fd, std::string_view text, int flags) {
  while (!text.empty()) {
    const ssize_t sent = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL | flags);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

}  // namespace

ControlSocket::ControlSocket(const std::filesystem::path& path)
    : path_(path), fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  if (fd_ < 0) fail(path, errno);
  const sockaddr_un address = address_of(path);
  const auto bind_here = [&] {
    // Creates the socket with its final mode, so that no other user can connect before a chmod.
    const mode_t before = ::umask(0177);
    const int result = ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    ::umask(before);
    return result == 0;
  };
  if (!bind_here() && errno == EADDRINUSE && std::filesystem::is_socket(path)) {
    const int other = connect_to(path);
    if (other >= 0) {
      ::close(other);
      ::close(fd_);
      fail(path, "another process already listens at this socket");
    }
    std::filesystem::remove(path);
    bind_here();
  }
  if (::listen(fd_, static_cast<int>(kMaxClients)) != 0) {
    const bool in_the_way = std::filesystem::exists(path);
    ::close(fd_);
    fail(path, in_the_way ? "the file exists and is not a socket" : "cannot create the socket");
  }
}

ControlSocket::~ControlSocket() {
  for (const Client& client : clients_) ::close(client.fd);
  ::close(fd_);
  ::unlink(path_.c_str());
}

void ControlSocket::wait_for(std::vector<pollfd>& fds) const {
  fds.push_back({fd_, POLLIN, 0});
  for (const Client& client : clients_) fds.push_back({client.fd, POLLIN, 0});
}

void ControlSocket::accept_all() {
  for (;;) {
    const int fd = ::accept4(fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() < kMaxClients) {
      clients_.push_back({fd, {}});
    } else {
      send_all(fd, "error: too many clients\n", MSG_DONTWAIT);
      ::close(fd);
    }
  }
}

bool ControlSocket::serve(Client& client, const std::function<std::string(std::string_view)>& answer) {
  std::array<char, 4096> piece;
  bool open = true;
  while (open) {
    const ssize_t got = ::recv(client.fd, piece.data(), piece.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
    open = got > 0;
    if (open) client.text.append(piece.data(), static_cast<std::size_t>(got));
    if (!open && !client.text.empty() && client.text.back() != '\n') client.text += '\n';
    std::size_t begin = 0;
    for (std::size_t end; (end = client.text.find('\n', begin)) != std::string::npos; begin = end + 1) {
      std::string_view line = std::string_view(client.text).substr(begin, end - begin);
      if (line.ends_with('\r')) line.remove_suffix(1);
      if (!line.empty() && !send_all(client.fd, answer(line) + "\n", MSG_DONTWAIT)) return false;
    }
    client.text.erase(0, begin);
    if (client.text.size() > kMaxLine) return false;
  }
  return open;
}

void ControlSocket::turn(const std::function<std::string(std::string_view)>& answer) {
  accept_all();
  std::erase_if(clients_, [&](Client& client) {
    if (serve(client, answer)) return false;
    ::close(client.fd);
    return true;
  });
}

std::string ask_control_socket(const std::filesystem::path& path, std::string_view line) {
  const int fd = connect_to(path);
  if (fd < 0) {
    throw std::runtime_error(path.string() + ": " + std::generic_category().message(errno) +
                             "; is tendon-inject running with --control " + path.string() + "?");
  }
  std::string answer;
  if (send_all(fd, std::string(line) + "\n", 0)) {
    std::array<char, 4096> piece;
    while (!answer.ends_with('\n')) {
      const ssize_t got = ::recv(fd, piece.data(), piece.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      answer.append(piece.data(), static_cast<std::size_t>(got));
    }
  }
  ::close(fd);
  if (!answer.ends_with('\n'))
    throw std::runtime_error(path.string() + ": the connection was closed without an answer");
  answer.pop_back();
  return answer;
}

}  // namespace tendon::injector
