// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/guests.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <random>
#include <string>
#include <system_error>

#include "clients/cpp/force_client.h"
#include "clients/cpp/udp_transport.h"
#include "core/base/reason.h"
#include "server/machine/clock.h"

namespace tendon::soak {

namespace {

constexpr Duration kLook = std::chrono::milliseconds(100);  ///< threads check this often whether to stop

ForceClient::Config observer(const std::string& name) {
  ForceClient::Config config;
  config.name = name;
  config.seed = Seed(std::random_device()());
  return config;
}

/// Takes one turn. It then waits until the next turn is due or until a datagram is received, but not longer than kLook.
template <class Transport>
void turn(ForceClient& client, Transport& transport) {
  const LocalTime due = client.turn(clock::now());
  transport.wait(std::min<Duration>(due - clock::now(), kLook));
}

/// Uses kHomes local addresses (127.1.0.1 and up), because HelloLimit accepts only a few clients per second from one.
class Home : public Link {
 public:
  static constexpr std::uint64_t kHomes = 200;

  Home(std::uint64_t number, const Address& server)
      : server_(server), socket_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    const sockaddr_in here = ipv4(0x7f010001U + static_cast<std::uint32_t>(number % kHomes), 0);
    const auto* ip = &server.ip[12];
    const sockaddr_in there =
        ipv4((std::uint32_t{ip[0]} << 24U) | (std::uint32_t{ip[1]} << 16U) | (std::uint32_t{ip[2]} << 8U) | ip[3],
             server.port);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0 ||
        connect(socket_, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0) {
      const int error = errno;
      close(socket_);
      throw std::system_error(error, std::generic_category(), "a visitor's socket");
    }
  }
  ~Home() override { close(socket_); }
  Home(const Home&) = delete;
  Home& operator=(const Home&) = delete;

  void send(const Address&, std::span<const std::byte> datagram) override {
    [[maybe_unused]] const ssize_t sent = ::send(socket_, datagram.data(), datagram.size(), 0);
  }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    from = server_;
    const ssize_t size = recv(socket_, buffer.data(), buffer.size(), MSG_TRUNC);
    return size > 0 ? static_cast<std::size_t>(size) : 0;
  }
  void wait(Duration timeout) const {
    if (timeout <= Duration::zero()) return;
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    const timespec time{.tv_sec = timeout / std::chrono::seconds(1),
                        .tv_nsec = (timeout % std::chrono::seconds(1)).count()};
    ppoll(&ready, 1, &time, nullptr);
  }

 private:
  static sockaddr_in ipv4(std::uint32_t ip, std::uint16_t port) {
    return {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {.s_addr = htonl(ip)}, .sin_zero = {}};
  }

  Address server_;
  int socket_;
};

class Promises {
 public:
  std::optional<std::string> broken(const DeviceState& state) {
    // If a state was missed, that state may have reported an overrun.
    const bool next = tick_ != 0 && state.tick == tick_ + 1;
    tick_ = state.tick;
    excused_ = state.energy < 0 && (excused_ || !next || Reasons::from_bits(state.reasons).has(Reason::kOverrun));
    if (!state.position.allFinite() || !state.force_applied.allFinite() || !std::isfinite(state.energy)) {
      return "a number that is not finite";
    }
    if (state.force_applied.norm() > state.permitted_force * (1 + 1e-9)) return "a force above the limiter's bound";
    if (state.energy < -1e-9 && !excused_) return "an account of " + std::to_string(state.energy) + " J";
    return std::nullopt;
  }

 private:
  std::uint64_t tick_ = 0;
  bool excused_ = false;
};

}  // namespace

Reconnecting::Reconnecting(const Address& server, std::uint64_t in_all, Duration duration, int threads) {
  const LocalTime start = clock::now();
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this, server, start, in_all, duration, threads, i] {
      const auto count = static_cast<std::uint64_t>(threads);
      for (auto n = static_cast<std::uint64_t>(i); n < in_all; n += count) {
        const LocalTime due = start + from_seconds(seconds(duration) * static_cast<double>(n) / double(in_all));
        while (!stop_ && clock::now() < due) clock::sleep_until(std::min(due, clock::now() + kLook));
        if (stop_) return;
        ++(visit(n, server) ? sessions_ : vain_);
      }
    });
  }
}

void Reconnecting::stop() {
  stop_ = true;
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

bool Reconnecting::visit(std::uint64_t number, const Address& server) const {
  Home transport(number, server);
  bool seen = false;
  ForceClient client(
      transport, server, observer("visitor"), [&seen](const auto&, const auto&) { seen = true; }, clock::now());
  const LocalTime end = clock::now() + kPatience;
  while (!seen && clock::now() < end) turn(client, transport);
  client.stop(clock::now());
  return seen;
}

Watching::Watching(const Address& server) : thread_([this, server] { watch(server); }) {}

void Watching::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::optional<std::string> Watching::broken() const {
  const std::lock_guard lock(mutex_);
  return broken_;
}

void Watching::watch(const Address& server) {
  UdpTransport transport(server);
  Promises promises;
  LocalTime heard{};
  ForceClient client(
      transport, server, observer("watcher"),
      [&](const DeviceState& state, const LinkStats&) {
        const LocalTime now = clock::now();
        if (states_ > 0) longest_silence_ = std::max<Duration::rep>(longest_silence_, (now - heard).count());
        heard = now;
        ++states_;
        if (const auto why = promises.broken(state); why && !broken()) {
          const std::lock_guard lock(mutex_);
          broken_ = "tick " + std::to_string(state.tick) + ": " + *why;
        }
      },
      clock::now());
  while (!stop_) {
    turn(client, transport);
    sessions_ = client.stats().sessions;
  }
  client.stop(clock::now());
}

}  // namespace tendon::soak
