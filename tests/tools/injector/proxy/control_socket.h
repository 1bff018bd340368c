// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::injector {

/// A Unix stream socket. Each line is a command and is answered with one line, so that `nc -U PATH` and `socat -
/// UNIX:PATH` can be clients. Only the user of this process can connect (mode 0600). Thread-safe: no.
class ControlSocket {
 public:
  static constexpr std::size_t kMaxClients = 8;
  /// A profile line can hold a table of some thousand values.
  static constexpr std::size_t kMaxLine = std::size_t{1} << 20;

  /// Replaces a stale socket. Throws std::runtime_error on failure, for example "--control /tmp/x: a process listens
  /// there already".
  explicit ControlSocket(const std::filesystem::path& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  void wait_for(std::vector<pollfd>& fds) const;

  /// Never blocks. `answer` must not return a line break. Disconnects a client that does not read its answers or sends
  /// more than kMaxLine bytes without a line break.
  void turn(const std::function<std::string(std::string_view line)>& answer);

 private:
  struct Client {
    int fd;
    std::string text;
  };
  void accept_all();
  static bool serve(Client& client, const std::function<std::string(std::string_view)>& answer);

  std::filesystem::path path_;
  int fd_;
  std::vector<Client> clients_;
};

/// Throws std::runtime_error if there is no listener or it closes the connection without an answer.
std::string ask_control_socket(const std::filesystem::path& path, std::string_view line);

}  // namespace tendon::injector
