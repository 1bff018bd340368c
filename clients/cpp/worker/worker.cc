// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/worker.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <string_view>

#include "clients/cpp/server_name.h"

namespace tendon::worker {
namespace {

constexpr std::string_view kUnix = "unix:";
constexpr std::string_view kTcp = "tcp:";

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread
  if (value == nullptr) {
    throw std::runtime_error(std::string(name) +
                             ": expected in the environment of the worker, which is started by a proxy");
  }
  return value;
}

int connected(int socket, const sockaddr* to, socklen_t size) {
  if (socket >= 0 && ::connect(socket, to, size) == 0) return socket;
  if (socket >= 0) ::close(socket);
  return -1;
}

int connect_to_path(const std::string& path) {
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  if (path.size() >= sizeof to.sun_path) return -1;
  std::ranges::copy(path, std::begin(to.sun_path));
  return connected(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

int connect_to_host(const std::string& name) {
  for (const Address& address : ServerName(name).look_up().addresses) {
    sockaddr_in6 to{};
    to.sin6_family = AF_INET6;
    to.sin6_port = htons(address.port);
    std::memcpy(&to.sin6_addr, address.ip.data(), address.ip.size());
    const int socket =
        connected(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0), reinterpret_cast<const sockaddr*>(&to), sizeof to);
    if (socket < 0) continue;
    const int yes = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    return socket;
  }
  return -1;
}

int connect_to(const std::string& address) {
  if (address.starts_with(kUnix)) return connect_to_path(address.substr(kUnix.size()));
  if (address.starts_with(kTcp)) return connect_to_host(address.substr(kTcp.size()));
  throw std::runtime_error(std::string(kAddressVariable) + ": expected unix:PATH or tcp:HOST:PORT, found \"" + address +
                           '"');
}

}  // namespace

WorkerStream::WorkerStream() {
  const std::string address = variable(kAddressVariable);
  const std::string secret = variable(kSecretVariable);
  socket_ = connect_to(address);
  if (socket_ < 0 || !send(opening(secret))) {
    const std::string why = std::strerror(errno);  // NOLINT(concurrency-mt-unsafe)
    if (socket_ >= 0) ::close(socket_);
    throw std::runtime_error(std::string(kAddressVariable) + ": no proxy is listening at " + address + ": " + why);
  }
}

WorkerStream::~WorkerStream() { ::close(socket_); }

std::optional<Record> WorkerStream::next() {
  std::array<std::byte, 4096> buffer;
  for (;;) {
    if (auto record = reader_.next()) return record;
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return std::nullopt;
    reader_.add({buffer.data(), static_cast<std::size_t>(size)});
  }
}

bool WorkerStream::send(const Record& answer) {
  const std::vector<std::byte> bytes = to_bytes(answer);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t sent = ::send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    done += static_cast<std::size_t>(sent);
  }
  return true;
}

void work(const Physics& engine) {
  WorkerStream stream;
  Codec codec;
  while (const auto record = stream.next()) {
    const auto hand = codec.read_state(*record);
    if (!hand) throw std::runtime_error("expected a state from the proxy, received something else");
    if (!stream.send(codec.answer(record->sequence, *hand, engine(*hand)))) return;
  }
}

}  // namespace tendon::worker
