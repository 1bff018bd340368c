// SPDX-License-Identifier: Apache-2.0
// Throughput of tendon-inject against a bare forwarder on the same core, and its release errors against those of a
// thread that only wakes up.
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/proxy/driver.h"
#include "tests/tools/injector/proxy/real_time.h"

namespace tendon::bench {
namespace {

using namespace injector;

using namespace std::chrono_literals;

constexpr std::size_t kBytes = 200;
/// If forwarding a datagram takes longer, the machine is too slow to be measured.
constexpr Duration kPatience = 10s;

void pin_to(unsigned core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core % std::max(1U, std::thread::hardware_concurrency()), &cores);
  ::sched_setaffinity(0, sizeof cores, &cores);
}
constexpr unsigned kForwarderCore = 0;
constexpr unsigned kLoadCore = 1;

Address loopback() { return parse_address("127.0.0.1:0"); }

/// The baseline in one direction, which only calls recvmmsg and sendmmsg.
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
                 .servers = {server},
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

/// At most `window` datagrams are in flight, so no buffer overflows and every loss is the forwarder's.
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
  while (monotonic_now() < start + length || (got == 0 && monotonic_now() < start + kPatience)) {
    const auto room = static_cast<std::size_t>(std::min<std::uint64_t>(window - (sent - got), kUdpBatch));
    if (room >= kUdpBatch / 2) {
      sent += room - client.send(std::span(batch).first(room)).count();
    } else {
      pollfd readable{server.fd(), POLLIN, 0};
      if (::poll(&readable, 1, 200) == 0 && got > 0) break;
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

double us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

void compare_throughput(Run& run, const std::string& name, const std::string& profile, std::uint64_t window, int rounds,
                        Duration length) {
  UdpBatch server = UdpBatch::listening(loopback());
  std::vector<double> bare;  // ns per datagram
  std::vector<double> proxied;
  std::vector<double> ratios;
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
  for (int round = 0; round < rounds; ++round) {
    {
      const BareForwarder forwarder(server.local_address());
      bare.push_back(1e9 / saturate(server, forwarder.address(), window, length).per_second);
    }
    {
      const RunningProxy proxy(server.local_address(), profile, Duration::zero());
      const Load load = saturate(server, proxy.address(), window, length);
      proxied.push_back(1e9 / load.per_second);
      sent += load.sent;
      lost += load.lost;
    }
    ratios.push_back(proxied.back() / bare.back());
  }
  Row row{.section = {},
          .what = "a datagram of 200 bytes forwarded, " + name,
          .unit = "ns",
          .n = sent,
          .p50 = quantile(proxied, 0.5),
          .p99 = quantile(proxied, 0.99),
          .floor = "recvmmsg, sendmmsg and nothing else",
          .floor_p50 = quantile(bare, 0.5),
          .floor_p99 = quantile(bare, 0.99),
          .ratio = quantile(ratios, 0.5),
          .note = {}};
  char note[160];
  std::snprintf(note, sizeof note, "%.0f/s beside %.0f/s; lost %llu", 1e9 / row.p50, 1e9 / *row.floor_p50,
                static_cast<unsigned long long>(lost));
  row.note = note;
  run.add(row);
}

/// Sends 1 kHz in each direction through 20 ± 5 ms to an echo, alternating with the baseline every second.
void compare_punctuality(Run& run, Duration spin, int rounds, Duration length) {
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
  const auto line = [&](const char* way, const DurationHistogram& late) {
    char name[120];
    std::snprintf(name, sizeof name, "released too late, 1 kHz through 20 ± 5 ms, %s, spin %.0f µs", way, us(spin));
    Row row{.section = {},
            .what = name,
            .unit = "µs",
            .n = late.count(),
            .p50 = us(late.quantile(0.5)),
            .p99 = us(late.quantile(0.99)),
            .floor = "the proxy's own thread, woken with nothing to send",
            .floor_p50 = us(status.timer_floor.quantile(0.5)),
            .floor_p99 = us(status.timer_floor.quantile(0.99)),
            .note = {}};
    if (*row.floor_p50 > 0) row.ratio = row.p50 / *row.floor_p50;
    run.add(row);
  };
  line("up", status.of(Direction::kUp).release_error);
  line("down", status.of(Direction::kDown).release_error);
}

/// Runs `work` in a thread with this priority and core, without changing those of the caller.
class Apart {
 public:
  template <class Work>
  explicit Apart(int priority, Work work) {
    std::exception_ptr error;
    std::thread thread([&] {
      try {
        const AtPriority high(priority);
        work();
      } catch (...) {
        error = std::current_exception();
      }
    });
    thread.join();
    if (error) std::rethrow_exception(error);
  }
};

}  // namespace

void measure_proxy(Run& run) {
  const bool quick = run.options.quick;
  const int rounds = quick ? 1 : 5;
  const Duration length = quick ? 50ms : 1s;
  const Apart apart(run.options.priority, [&] {
    compare_throughput(run, "no delay", "", 512, rounds, length);
    compare_punctuality(run, 50us, quick ? 2 : 8, length);
    if (quick) return;
    compare_throughput(run, "1 to 3 ms", "delay=uniform(1ms,3ms) loss=0% duplicate=0%", 2048, rounds, length);
    compare_punctuality(run, Duration::zero(), 8, length);
  });
}

}  // namespace tendon::bench
