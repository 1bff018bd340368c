// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/udp_wire.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <random>
#include <system_error>
#include <utility>

namespace tendon::conformance {
namespace {

/// Holds a second of states from every session that is not being read.
constexpr int kReceiveBuffer = 4 << 20;

}  // namespace

UdpWire UdpWire::to_server(const Address& peer) { return {peer, true}; }

UdpWire UdpWire::for_client(const Address& listen) {
  UdpWire wire(Address{}, false);
  wire.add(listen);
  return wire;
}

LocalTime UdpWire::now() { return LocalTime(std::chrono::steady_clock::now().time_since_epoch()); }

void UdpWire::add(const Address& local) {
  ports_.push_back({std::make_unique<UdpLink>(local, Reach::kAnywhere), {}});
  // Best effort: the system may grant less.
  ::setsockopt(ports_.back().link->fd(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
}

int UdpWire::open_port() {
  if (!peer_is_server_) return 0;
  if (is_loopback(peer_)) {
    add({.ip = peer_.ip, .port = 0});
  } else {
    add(parse_address(is_ipv4(peer_) ? "0.0.0.0:0" : "[::]:0"));
  }
  return static_cast<int>(ports_.size()) - 1;
}

void UdpWire::send(int port, Span datagram) { ports_.at(static_cast<std::size_t>(port)).link->send(peer_, datagram); }

void UdpWire::drain() {
  std::array<std::byte, 2048> buffer;
  for (Port& port : ports_) {
    Address from;
    while (const std::size_t size = port.link->receive(from, buffer)) {
      Bytes datagram(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(std::min(size, buffer.size())));
      if (peer_is_server_ && from != peer_) continue;
      const auto head = read_head(datagram);
      if (!peer_is_server_ && head && head->type == kHelloType) peer_ = from;
      port.arrived.push_back({now(), std::move(datagram)});
    }
  }
}

std::optional<Wire::Arrival> UdpWire::receive(int port, LocalTime deadline) {
  auto& arrived = ports_.at(static_cast<std::size_t>(port)).arrived;
  for (;;) {
    drain();
    if (!arrived.empty()) {
      Arrival first = std::move(arrived.front());
      arrived.pop_front();
      return first;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - now());
    if (left <= std::chrono::milliseconds::zero()) return std::nullopt;
    std::vector<pollfd> fds;
    for (const Port& each : ports_) fds.push_back({.fd = each.link->fd(), .events = POLLIN, .revents = 0});
    ::poll(fds.data(), fds.size(), static_cast<int>(left.count()));
  }
}

std::uint64_t UdpWire::random() {
  std::random_device device;
  return std::uint64_t{device()} << 32U | device();
}

GuestProgram::GuestProgram(std::vector<std::string> command, std::string log)
    : command_(std::move(command)), log_(log.empty() ? "/dev/null" : std::move(log)) {}

void GuestProgram::start() {
  std::vector<char*> argv;
  for (std::string& word : command_) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  // A new process group, so that killing a shell script also kills its children.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error = posix_spawnp(&pid_, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    pid_ = 0;
    throw std::system_error(error, std::system_category(), "cannot start " + command_[0]);
  }
}

void GuestProgram::ask_to_end() {
  if (pid_ != 0) ::kill(-pid_, SIGTERM);
}

void GuestProgram::kill() {
  if (pid_ == 0) return;
  ::kill(-pid_, SIGKILL);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
}

bool GuestProgram::running() {
  siginfo_t info{};
  return pid_ != 0 && ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0;
}

}  // namespace tendon::conformance
