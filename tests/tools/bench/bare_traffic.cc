// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/bare_traffic.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "server/machine/clock.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/guest_socket.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {

using std::chrono::milliseconds;

namespace {

struct BareShared {
  std::atomic<bool> quit{false};
  std::atomic<bool> ready{false};
  injector::DurationHistogram age;
};

void answer_bare(const BareTraffic& traffic, const std::vector<std::unique_ptr<GuestSocket>>& sockets,
                 BareShared& shared) {
  const AtPriority high(traffic.priority);
  const Duration unix_offset = clock::unix_offset();
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  if (epoll < 0) fail("epoll");
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u32 = static_cast<std::uint32_t>(i);
    if (::epoll_ctl(epoll, EPOLL_CTL_ADD, sockets[i]->fd(), &event) != 0) fail("epoll_ctl");
  }
  std::vector<std::size_t> got(sockets.size());
  std::array<epoll_event, 64> ready{};
  std::array<std::byte, kMaxDatagram> buffer{};
  shared.ready = true;
  while (!shared.quit) {
    const int n = ::epoll_wait(epoll, ready.data(), static_cast<int>(ready.size()), 10);
    for (int e = 0; e < n; ++e) {
      const std::size_t i = ready[static_cast<std::size_t>(e)].data.u32;
      for (Duration at{}; sockets[i]->receive(buffer, at) > 0;) {
        Duration sent{};
        std::memcpy(&sent, buffer.data(), sizeof sent);
        shared.age.observe(at - unix_offset - sent);
        if (++got[i] % traffic.out_per_round != 0) continue;
        for (std::size_t k = 0; k < traffic.in_per_round; ++k) {
          sockets[i]->send(std::span<const std::byte>(buffer).first(traffic.in_bytes));
        }
      }
    }
  }
  ::close(epoll);
}

}  // namespace

BareResult run_bare(const BareTraffic& traffic) {
  raise_file_limit();
  const UdpLink host(parse_address("127.0.0.1:0"));
  std::vector<std::unique_ptr<GuestSocket>> sockets;
  std::vector<sockaddr_in> addresses(traffic.sessions);
  for (std::size_t i = 0; i < traffic.sessions; ++i) {
    sockets.push_back(std::make_unique<GuestSocket>(host.local_address(), i));
    socklen_t size = sizeof addresses[i];
    if (::getsockname(sockets[i]->fd(), reinterpret_cast<sockaddr*>(&addresses[i]), &size) != 0) fail("getsockname");
  }
  const SharedMemory<BareShared> shared;
  std::optional<OtherProcess> guests(std::in_place, [&] { answer_bare(traffic, sockets, *shared); });
  sockets.clear();
  while (!shared->ready) {
    guests->check();
    clock::sleep_until(clock::now() + milliseconds(1));
  }

  BareResult result;
  std::thread thread([&] {
    enter_punctual();
    const AtPriority high(traffic.priority);
    pollfd readable{host.fd(), POLLIN, 0};
    std::array<std::byte, kMaxDatagram> buffer{};
    const Duration began = clock::processor_time();
    const Duration guests_began = guests->processor_time();
    LocalTime due = clock::now();
    for (const LocalTime end = due + traffic.length; due < end; due += traffic.period) {
      const Duration stamp = due.time_since_epoch();
      std::memcpy(buffer.data(), &stamp, sizeof stamp);
      for (std::size_t i = 0; i < traffic.sessions; ++i) {
        for (std::size_t k = 0; k < traffic.out_per_round; ++k) {
          result.sent += ::sendto(host.fd(), buffer.data(), traffic.out_bytes, 0,
                                  reinterpret_cast<const sockaddr*>(&addresses[i]), sizeof addresses[i]) > 0
                             ? 1
                             : 0;
        }
      }
      ++result.rounds;
      for (LocalTime now = clock::now(); now < due + traffic.period; now = clock::now()) {
        const timespec left{0, static_cast<long>((due + traffic.period - now).count())};
        if (::ppoll(&readable, 1, &left, nullptr) <= 0) continue;
        sockaddr_in from{};
        socklen_t size = sizeof from;
        while (::recvfrom(host.fd(), buffer.data(), buffer.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from),
                          &size) > 0) {
          ++result.received;
        }
      }
    }
    result.host = clock::processor_time() - began;
    result.guests = guests->processor_time() - guests_began;
  });
  thread.join();
  shared->quit = true;
  guests.reset();
  result.age = shared->age;
  result.seconds = static_cast<double>(result.rounds) * seconds(traffic.period);
  return result;
}

}  // namespace tendon::bench
