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

/// A Unix stream socket that takes commands, one line of text each, and answers each with one line: `nc -U PATH` and
/// `socat - UNIX:PATH` are clients. Only the user who runs this process can connect (mode 0600).
///
/// Thread-safe: no.
class ControlSocket {
 public:
  /// People at a terminal and a script or two.
  static constexpr std::size_t kMaxClients = 8;
  /// A profile line may hold a table of some thousand values.
  static constexpr std::size_t kMaxLine = std::size_t{1} << 20;

  /// Listens on `path`, in place of a socket that nobody listens on any more. Throws std::runtime_error when that
  /// cannot be done: "--control /tmp/x: a process listens there already".
  explicit ControlSocket(const std::filesystem::path& path);
  /// Removes the socket from the file system.
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  /// Adds what poll(2) should wait for.
  void wait_for(std::vector<pollfd>& fds) const;

  /// Takes what has come, never waits, and answers each line by `answer(line)`, whose result must hold no line break. A
  /// client that does not read its answers, or sends more than kMaxLine without a line break, is disconnected.
  void turn(const std::function<std::string(std::string_view line)>& answer);

 private:
  struct Client {
    int fd;
    std::string text;  ///< of a line that is not complete
  };
  void accept_all();
  static bool serve(Client& client, const std::function<std::string(std::string_view)>& answer);

  std::filesystem::path path_;
  int fd_;
  std::vector<Client> clients_;
};

/// Sends one command to the control socket at `path` and returns the answer. Throws std::runtime_error when nobody
/// listens there, or goes away without an answer.
std::string ask_control_socket(const std::filesystem::path& path, std::string_view line);

}  // namespace tendon::injector
