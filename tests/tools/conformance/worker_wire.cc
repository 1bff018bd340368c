// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/worker_wire.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <random>
#include <system_error>
#include <utility>

#include "clients/cpp/worker/stream.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLook{20};
/// Time between SIGTERM and SIGKILL, in which mpirun can end its ranks.
constexpr Duration kPolite = std::chrono::seconds(2);

[[noreturn]] void fail_with(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

void close(int& file) {
  if (file >= 0) ::close(std::exchange(file, -1));
}

template <class SocketAddress>
void listen_at(int socket, const SocketAddress& at, const std::string& name) {
  if (socket < 0 || ::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
      ::listen(socket, 1) != 0) {
    fail_with("cannot listen at " + name);
  }
}

}  // namespace

WorkerProgram::WorkerProgram(std::vector<std::string> command, std::string log, const Address& listen)
    : program_(std::move(command), std::move(log)), tcp_(listen) {}

WorkerProgram::~WorkerProgram() { kill(); }

LocalTime WorkerProgram::now() { return LocalTime(std::chrono::steady_clock::now().time_since_epoch()); }

std::string WorkerProgram::listen(Road road) {
  if (road == Road::kUnix) {
    folder_ = (std::filesystem::temp_directory_path() / "tendon-conformance-XXXXXX").string();
    if (::mkdtemp(folder_.data()) == nullptr) fail_with("cannot create the folder " + std::exchange(folder_, ""));
    const std::string path = folder_ + "/worker";
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    if (path.size() >= sizeof at.sun_path)
      throw std::runtime_error(path + " is too long for a socket; set TMPDIR to a shorter path");
    std::ranges::copy(path, std::begin(at.sun_path));
    listen_at(listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), at, path);
    return "unix:" + path;
  }
  sockaddr_in6 at{};
  at.sin6_family = AF_INET6;
  at.sin6_port = htons(tcp_.port);
  std::memcpy(&at.sin6_addr, tcp_.ip.data(), tcp_.ip.size());
  listener_ = ::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int no = 0;
  ::setsockopt(listener_, IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no);
  listen_at(listener_, at, to_string(tcp_));
  socklen_t size = sizeof at;
  if (::getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0) fail_with("getsockname");
  return "tcp:" + to_string(Address{.ip = tcp_.ip, .port = ntohs(at.sin6_port)});
}

void WorkerProgram::start(Road road, const std::string& secret) {
  kill();
  const std::string address = listen(road);
  // NOLINTBEGIN(concurrency-mt-unsafe): there is one thread
  ::setenv(worker::kAddressVariable, address.c_str(), 1);
  ::setenv(worker::kSecretVariable, secret.c_str(), 1);
  // NOLINTEND(concurrency-mt-unsafe)
  program_.start();
}

bool WorkerProgram::accept_one() {
  stream_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (stream_ < 0) return false;
  const int yes = 1;
  ::setsockopt(stream_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);  // fails for a Unix socket, which does not need it
  close(listener_);
  return true;
}

std::optional<WorkerWire::Heard> WorkerProgram::receive(LocalTime deadline) {
  for (;;) {
    const bool ran = program_.running();
    const auto left = std::chrono::ceil<milliseconds>(deadline - now());
    pollfd ready{.fd = stream_ >= 0 ? stream_ : listener_, .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, static_cast<int>(std::clamp(left, milliseconds(0), kLook).count())) > 0) {
      if (stream_ < 0) {
        accept_one();
        continue;
      }
      std::array<std::byte, 4096> buffer;
      const ssize_t size = ::recv(stream_, buffer.data(), buffer.size(), 0);
      if (size > 0) return Heard{.bytes = {buffer.begin(), buffer.begin() + size}};
      return Heard{.ended = "the stream has ended"};
    }
    if (!ran)
      return Heard{.ended = stream_ < 0 ? "the program has ended without a connection" : "the program has ended"};
    if (left <= milliseconds::zero()) return std::nullopt;
  }
}

void WorkerProgram::send(Span bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t sent = ::send(stream_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return;  // receive() reports the error
    done += static_cast<std::size_t>(sent);
  }
}

void WorkerProgram::end_stream() { close(stream_); }

bool WorkerProgram::ends(LocalTime deadline) {
  while (program_.running()) {
    if (now() >= deadline) return false;
    ::poll(nullptr, 0, static_cast<int>(kLook.count()));
  }
  return true;
}

void WorkerProgram::kill() {
  close(stream_);
  close(listener_);
  program_.ask_to_end();
  ends(now() + kPolite);
  program_.kill();
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(std::exchange(folder_, ""), ignored);
}

std::uint64_t WorkerProgram::random() {
  std::random_device device;
  return std::uint64_t{device()} << 32U | device();
}

}  // namespace tendon::conformance
