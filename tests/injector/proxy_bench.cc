// SPDX-License-Identifier: Apache-2.0
// How fast and how punctual the proxy is, against what the machine can do, in the same run: throughput against a bare
// forwarder on the same core, release errors against a thread that only sleeps. README.md has results.
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/injector/driver.h"
#include "tests/injector/profile.h"
#include "tests/injector/real_time.h"

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kBytes = 200;

void pin_to(unsigned core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core % std::max(1U, std::thread::hardware_concurrency()), &cores);
  ::sched_setaffinity(0, sizeof cores, &cores);
}
constexpr unsigned kForwarderCore = 0;
constexpr unsigned kLoadCore = 1;

Address loopback() { return parse_address("127.0.0.1:0"); }

/// recvmmsg and sendmmsg and nothing else: no times, no decisions, no flight. One direction.
class BareForwarder {
 public:
  explicit BareForwarder(const Address& server)
      : in_(UdpBatch::listening(loopback())), out_(UdpBatch::connected(server)), thread_([this] { run(); }) {}
  ~BareForwarder() {
    stop_ = true;
    thread_.join();
  }
  Address address() const { return in_.local_address(); }

 private:
  void run() {
    pin_to(kForwarderCore);
    std::vector<std::array<std::byte, 2048>> buffers(kUdpBatch);
    std::array<iovec, kUdpBatch> pieces;
    std::array<mmsghdr, kUdpBatch> messages{};
    for (std::size_t i = 0; i < kUdpBatch; ++i) messages[i].msg_hdr = {nullptr, 0, &pieces[i], 1, nullptr, 0, 0};
    const int off = 0;
    ::setsockopt(in_.fd(), SOL_SOCKET, SO_TIMESTAMPNS, &off, sizeof off);
    while (!stop_) {
      for (std::size_t i = 0; i < kUdpBatch; ++i) pieces[i] = {buffers[i].data(), buffers[i].size()};
      const int got = ::recvmmsg(in_.fd(), messages.data(), kUdpBatch, MSG_DONTWAIT, nullptr);
      if (got <= 0) {
        pollfd readable{in_.fd(), POLLIN, 0};
        ::poll(&readable, 1, 10);
        continue;
      }
      for (int i = 0; i < got; ++i)
        pieces[static_cast<std::size_t>(i)].iov_len = messages[static_cast<std::size_t>(i)].msg_len;
      ::sendmmsg(out_.fd(), messages.data(), static_cast<unsigned>(got), 0);
    }
  }

  UdpBatch in_;
  UdpBatch out_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

class RunningProxy {
 public:
  RunningProxy(const Address& server, const std::string& profile, Duration spin)
      : driver_({.listen = loopback(),
                 .server = server,
                 .proxy = {.networks = {Injector(parse_profile(profile), 7, 0, Direction::kUp),
                                        Injector(parse_profile(profile), 7, 0, Direction::kDown)}},
                 .spin = spin},
                nullptr),
        thread_([this] {
          pin_to(kForwarderCore);
          driver_.run();
        }) {}
  ~RunningProxy() { stop(); }
  void stop() {
    driver_.stop();
    if (thread_.joinable()) thread_.join();
  }
  Address address() const { return driver_.local_address(); }
  Status status() const { return driver_.status(); }

 private:
  Driver driver_;
  std::thread thread_;
};

struct Load {
  double per_second = 0;
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
};

/// Both ends in one thread: as many datagrams as possible with at most `window` of them on their way, so that no buffer
/// overflows and every lost one is the forwarder's fault.
Load saturate(UdpBatch& server, const Address& forwarder, std::uint64_t window, Duration length) {
  pin_to(kLoadCore);
  UdpBatch client = UdpBatch::connected(forwarder);
  UdpBatch::Inbox inbox;
  const std::vector<std::byte> payload(kBytes, std::byte{1});
  std::vector<UdpBatch::Outgoing> batch(kUdpBatch, {{}, payload});
  std::uint64_t sent = 0;
  std::uint64_t got = 0;
  const LocalTime start = monotonic_now();
  LocalTime last_arrival = start;
  const auto receive = [&] {
    for (std::size_t n = kUdpBatch; n == kUdpBatch;) {
      n = server.receive(inbox).size();
      got += n;
      if (n > 0) last_arrival = monotonic_now();
    }
  };
  while (monotonic_now() < start + length) {
    const auto room = static_cast<std::size_t>(std::min<std::uint64_t>(window - (sent - got), kUdpBatch));
    if (room >= kUdpBatch / 2) {
      sent += room - client.send(std::span(batch).first(room)).count();
    } else {
      pollfd readable{server.fd(), POLLIN, 0};
      if (::poll(&readable, 1, 200) == 0) break;  // the window is lost: so is the rest of this round
    }
    receive();
  }
  const double elapsed = seconds(monotonic_now() - start);
  const double per_second = static_cast<double>(got) / elapsed;
  while (got < sent && monotonic_now() < last_arrival + 500ms) {
    pollfd readable{server.fd(), POLLIN, 0};
    ::poll(&readable, 1, 100);
    receive();
  }
  return {per_second, sent, sent - got};
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0 : values[values.size() / 2];
}

double us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

void compare_throughput(const std::string& profile, std::uint64_t window, int rounds, Duration length) {
  UdpBatch server = UdpBatch::listening(loopback());
  std::vector<double> bare;
  std::vector<double> proxied;
  std::vector<double> ratios;
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
  std::uint64_t bare_lost = 0;
  for (int round = 0; round < rounds; ++round) {
    {
      const BareForwarder forwarder(server.local_address());
      const Load load = saturate(server, forwarder.address(), window, length);
      bare.push_back(load.per_second);
      bare_lost += load.lost;
    }
    {
      const RunningProxy proxy(server.local_address(), profile, Duration::zero());
      const Load load = saturate(server, proxy.address(), window, length);
      proxied.push_back(load.per_second);
      sent += load.sent;
      lost += load.lost;
    }
    ratios.push_back(proxied.back() / bare.back());
  }
  std::printf(
      "throughput, %zu bytes, \"%s\", window %llu, %d rounds of %.1f s each: bare %.0f/s (lost %llu), proxy %.0f/s, "
      "median ratio %.2f (%.2f … %.2f), lost %llu of %llu\n",
      kBytes, profile.c_str(), static_cast<unsigned long long>(window), rounds, seconds(length), median(bare),
      static_cast<unsigned long long>(bare_lost), median(proxied), median(ratios), *std::ranges::min_element(ratios),
      *std::ranges::max_element(ratios), static_cast<unsigned long long>(lost), static_cast<unsigned long long>(sent));
}

/// How late clock_nanosleep(2) wakes a thread that sleeps as long as datagrams take, on the core of the proxy.
DurationHistogram sleep_floor(Duration length, const std::atomic<bool>& stop) {
  pin_to(kForwarderCore);
  DurationHistogram late;
  LocalTime due = monotonic_now();
  while (!stop) {
    due = std::max(due + length, monotonic_now() + 100us);
    const auto since = due.time_since_epoch();
    const auto whole = std::chrono::floor<std::chrono::seconds>(since);
    const timespec time{.tv_sec = whole.count(), .tv_nsec = (since - whole).count()};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
    }
    late.observe(monotonic_now() - due);
  }
  return late;
}

void print(const char* name, const DurationHistogram& late, const DurationHistogram& floor) {
  const auto ratio = [&](double q) { return us(late.quantile(q)) / std::max(us(floor.quantile(q)), 1e-3); };
  std::printf("  %-28s p50 %7.1f us (%.2f of the floor)  p99 %8.1f us (%.2f)  max %9.1f us  n = %llu\n", name,
              us(late.quantile(0.5)), ratio(0.5), us(late.quantile(0.99)), ratio(0.99), us(late.max()),
              static_cast<unsigned long long>(late.count()));
}

/// 1 kHz each way through 20 ± 5 ms, an echo at the other end, and meanwhile, in turns of a second, the floor.
void compare_punctuality(Duration spin, int rounds, Duration length) {
  UdpBatch server = UdpBatch::listening(loopback());
  RunningProxy proxy(server.local_address(), "delay=uniform(15ms,25ms)", spin);
  pin_to(kLoadCore);
  UdpBatch client = UdpBatch::connected(proxy.address());
  UdpBatch::Inbox inbox;
  const std::vector<std::byte> payload(kBytes, std::byte{1});
  const UdpBatch::Outgoing datagram{{}, payload};
  LocalTime next = monotonic_now();
  const LocalTime end = next + length * rounds;
  while (next < end) {
    const Duration left = std::max(next - monotonic_now(), Duration::zero());
    const timespec time{0, static_cast<long>(left.count())};
    std::array<pollfd, 2> readable = {pollfd{server.fd(), POLLIN, 0}, pollfd{client.fd(), POLLIN, 0}};
    ::ppoll(readable.data(), readable.size(), &time, nullptr);
    for (const UdpBatch::Arrival& arrival : server.receive(inbox)) {
      const UdpBatch::Outgoing echo{arrival.from, arrival.datagram};
      server.send({&echo, 1});
    }
    client.receive(inbox);
    for (; monotonic_now() >= next; next += 1ms) client.send({&datagram, 1});
  }
  proxy.stop();
  const Status status = proxy.status();
  std::atomic<bool> stop = false;
  DurationHistogram slept;
  std::thread sleeper([&] { slept = sleep_floor(500us, stop); });
  const timespec while_floor{
      static_cast<time_t>(std::chrono::ceil<std::chrono::seconds>(length * rounds).count() / 4 + 1), 0};
  ::nanosleep(&while_floor, nullptr);
  stop = true;
  sleeper.join();
  std::printf("punctuality, 1 kHz each way, %zu bytes, 20 ± 5 ms, spin %.0f us\n", kBytes, us(spin));
  print("floor: the proxy's probes", status.timer_floor, status.timer_floor);
  print("floor: clock_nanosleep after", slept, status.timer_floor);
  print("up", status.of(Direction::kUp).release_error, status.timer_floor);
  print("down", status.of(Direction::kDown).release_error, status.timer_floor);
}

int main(int argc, char** argv) {
  const bool smoke = argc == 2 && std::string_view(argv[1]) == "--smoke";
  if (argc > 1 && !smoke) {
    std::fprintf(stderr,
                 "usage: proxy_bench [--smoke]\nExample: proxy_bench --smoke    (a second, to see that it runs)\n");
    return std::string_view(argv[1]) == "--help" ? 0 : 2;
  }
  const int rounds = smoke ? 1 : 7;
  const Duration length = smoke ? 100ms : 1s;
  compare_throughput("", 512, rounds, length);
  compare_throughput("delay=uniform(1ms,3ms) loss=0% duplicate=0%", 2048, rounds, length);
  compare_punctuality(Duration::zero(), smoke ? 1 : 20, length);
  compare_punctuality(50us, smoke ? 1 : 10, length);
  return 0;
}

}  // namespace
}  // namespace tendon::injector

int main(int argc, char** argv) { return tendon::injector::main(argc, argv); }
