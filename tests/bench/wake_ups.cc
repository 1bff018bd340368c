// SPDX-License-Identifier: Apache-2.0
//
// How late the haptic thread wakes with a controller alone, and with 32 observers besides, who cost a datagram each in
// every step; and beside them a thread that only sleeps. All take turns in blocks within one run of one server, whose
// threads are those of tendond: haptic (real-time priority where it is granted), network, and a log that takes records
// out. The observers are in one process, and cost processor time themselves: it is told apart.
#include <poll.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/udp_transport.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/clock.h"
#include "server/doorbell.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/realtime.h"
#include "server/udp_link.h"
#include "tests/bench/bench.h"
#include "tests/bench/measure.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

/// At the beginning of each block: guests have come or gone.
constexpr Duration kSettle = milliseconds(200);

struct Options {
  std::size_t observers = 32;
  int blocks = 8;  ///< of each kind
  int block_ms = 1000;
};

/// All guests, in one process of their own: a wall, and observers who come when told to. It wakes once in a millisecond
/// and takes what has come to all of them: 32 that wake by themselves would cost more than the server.
class Guests {
 public:
  Guests(const Address& server, std::size_t observers) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
      throw std::system_error(errno, std::generic_category(), "socketpair");
    }
    child_ = ::fork();
    if (child_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
    orders_ = ends[child_ > 0 ? 0 : 1];
    ::close(ends[child_ > 0 ? 1 : 0]);
    if (child_ > 0) return;
    try {
      serve(server, observers);
      ::_exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "tendon-lab bench: guests: %s\n", error.what());
      ::_exit(1);
    }
  }
  ~Guests() {
    ::close(orders_);  // the end of its orders
    ::waitpid(child_, nullptr, 0);
  }
  Guests(const Guests&) = delete;
  Guests& operator=(const Guests&) = delete;

  /// Returns when they are all there, or have gone.
  void let_observers_in(bool in) {
    const char order = in ? 'i' : 'o';
    if (::write(orders_, &order, 1) != 1) throw std::runtime_error("the guests are gone");
    pollfd fd{orders_, POLLIN, 0};
    char done = 0;
    if (::poll(&fd, 1, 30'000) != 1 || ::read(orders_, &done, 1) != 1) {
      throw std::runtime_error("not all of the observers have come within 30 s");
    }
  }

  pid_t pid() const { return child_; }

 private:
  struct Guest {
    Guest(const Address& server, const ForceClient::Config& config, bool controls)
        : link(server),
          client(controls ? ForceClient(
                                link, server, config,
                                [](const DeviceState& hand) -> Touch {
                                  return Vec3(-2000 * std::max(0.0, hand.position.x()), 0, 0);
                                },
                                clock::now())
                          : ForceClient(
                                link, server, config, [](const DeviceState&, const LinkStats&) {}, clock::now())) {}
    UdpTransport link;
    ForceClient client;
  };

  void serve(const Address& server, std::size_t observers) {
    std::vector<std::unique_ptr<Guest>> guests;
    ForceClient::Config config;
    config.name = "wall";
    config.seed = 1;
    guests.push_back(std::make_unique<Guest>(server, config, true));
    config.name = "observer";
    std::size_t wanted = 0;
    bool told = false;
    for (;;) {
      for (const auto& guest : guests) guest->client.turn(clock::now());
      // One after the other: a server takes 16 at once.
      if (guests.back()->client.phase() == ForceClient::Phase::kOpen) {
        if (guests.size() <= wanted) {
          guests.push_back(std::make_unique<Guest>(server, config, false));
        } else if (std::exchange(told, false) && ::write(orders_, "d", 1) != 1) {
          return;
        }
      }
      pollfd fd{orders_, POLLIN, 0};
      const timespec period{0, 1'000'000};
      if (::ppoll(&fd, 1, &period, nullptr) <= 0) continue;
      char order = 0;
      if (::read(orders_, &order, 1) != 1) return;
      wanted = order == 'i' ? observers : 0;
      told = true;
      if (wanted > 0) continue;
      for (std::size_t i = 1; i < guests.size(); ++i) guests[i]->client.stop(clock::now());
      guests.resize(1);
    }
  }

  int orders_ = -1;
  pid_t child_ = 0;
};

/// Of one kind of block, all of them together.
struct Figures {
  std::vector<double> late;  ///< µs, of each wake-up
  std::uint64_t overruns = 0;
  std::uint64_t datagrams = 0;  ///< that the server has sent
  Duration network_thread{};    ///< processor time
  Duration guests{};            ///< likewise, of their process
};

SimulatedDevice::Config device_config() {
  SimulatedDevice::Config device = find_device_profile("falcon")->device();
  device.hand =
      OperatorHand::Config{.stiffness = 300,
                           .damping = 3,
                           .mass = 0.05,
                           .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.5})};
  return device;
}

class WakeUps {
 public:
  explicit WakeUps(const Options& options)
      : options_(options),
        device_(device_config()),
        guests_(link_.local_address(), options.observers),
        haptic_(loop_config(device_), device_, mail_),
        network_(
            [&] {
              NetworkLoop::Config config;
              config.max_observers = options.observers;
              DeviceDescription about;
              about.name = "device";
              about.model = device_.info().name;
              about.max_force = device_.info().max_force;
              about.loop_hz = 1000;
              about.channels = {{.name = "main"}};
              config.devices = {about};
              return config;
            }(),
            link_, {&mail_}) {}

  void run() {
    std::thread network([this] { run_network(); });
    std::thread haptic([this] { run_haptic(); });
    try {
      clockid_t network_clock{};
      clockid_t guests_clock{};
      pthread_getcpuclockid(network.native_handle(), &network_clock);
      clock_getcpuclockid(guests_.pid(), &guests_clock);
      for (int block = 0; block < 2 * options_.blocks; ++block) {
        only_sleep();
        const bool with = block % 2 == 1;
        guests_.let_observers_in(with);
        watch(kSettle, nullptr);
        Figures& figures = with ? observed : alone;
        const std::uint64_t overruns = haptic_.stats().overruns;
        const std::uint64_t sent = datagrams_;
        const Duration network_before = read(network_clock);
        const Duration guests_before = read(guests_clock);
        watch(milliseconds(options_.block_ms), &figures);
        figures.overruns += haptic_.stats().overruns - overruns;
        figures.datagrams += datagrams_ - sent;
        figures.network_thread += read(network_clock) - network_before;
        figures.guests += read(guests_clock) - guests_before;
      }
    } catch (...) {
      end(haptic, network);
      throw;
    }
    end(haptic, network);
  }

  Figures asleep, alone, observed;
  bool realtime = true;
  std::uint64_t welcomed() const { return network_.stats().welcomed; }

 private:
  static HapticLoop::Config loop_config(const SimulatedDevice& device) {
    HapticLoop::Config config;
    config.control.limiter.friction = {0.3, 0.8};
    config.control.limiter.longest_hold = milliseconds(2);
    config.control.max_force = device.info().max_force;
    config.control.max_slew = 1000;
    return config;
  }

  void run_haptic() {
    realtime = enter_realtime(kHapticPriority).empty();
    LocalTime due = clock::now();
    while (!stop_) {
      if (resting_) {
        clock::sleep_until(clock::now() + milliseconds(1));
        due = clock::now();
        continue;
      }
      due = haptic_.step(clock::now());
      stepped_.ring();
      clock::sleep_until(due);
    }
    haptic_.stop();
  }

  void run_network() {
    enter_punctual();
    LocalTime due = clock::now();
    while (!stop_) {
      const LocalTime before = clock::now();
      if (due > before) link_.wait(std::min<Duration>(due - before, std::chrono::seconds(1)), &stepped_);
      due = network_.turn(clock::now());
    }
    network_.close(clock::now());
  }

  /// A thread like the haptic one that does nothing else, while that one rests.
  void only_sleep() {
    resting_ = true;
    clock::sleep_until(clock::now() + milliseconds(5));
    std::thread sleeper([this] {
      enter_realtime(kHapticPriority);
      const LocalTime end = clock::now() + milliseconds(options_.block_ms);
      for (LocalTime due = clock::now() + milliseconds(1); due < end;) {
        clock::sleep_until(due);
        const LocalTime now = clock::now();
        asleep.late.push_back(1e6 * seconds(now - due));
        due += milliseconds(1);
        if (due <= now) due = now + milliseconds(1);
      }
    });
    sleeper.join();
    resting_ = false;
  }

  void end(std::thread& haptic, std::thread& network) {
    stop_ = true;
    haptic.join();
    stepped_.ring();
    network.join();
  }

  static Duration read(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  }

  /// The log thread: takes records out, and keeps how late the steps were.
  void watch(Duration lasts, Figures* into) {
    for (const LocalTime end = clock::now() + lasts; clock::now() < end;) {
      while (const StepRecord* step = mail_.steps.front()) {
        if (into != nullptr) into->late.push_back(1e6 * seconds(step->hand.at - step->scheduled));
        mail_.steps.pop();
      }
      while (const DatagramRecord* record = mail_.datagrams.front()) {
        datagrams_ += record->direction == DatagramRecord::Direction::kOut ? 1 : 0;
        mail_.datagrams.pop();
      }
      clock::sleep_until(clock::now() + milliseconds(20));
    }
  }

  Options options_;
  SimulatedDevice device_;
  Mailboxes mail_;
  UdpLink link_{parse_address("127.0.0.1:0")};
  Guests guests_;  // forks before there are threads
  Doorbell stepped_;
  HapticLoop haptic_;
  NetworkLoop network_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> resting_{false};  ///< the haptic thread takes no steps
  std::uint64_t datagrams_ = 0;
};

}  // namespace

void measure_wake_ups(Run& run) {
  Options options;
  if (run.options.quick) options = {.observers = 3, .blocks = 1, .block_ms = 50};
  WakeUps wake_ups(options);
  wake_ups.run();
  ::munlockall();  // of enter_realtime
  const std::uint64_t expected = 1 + options.observers * static_cast<std::uint64_t>(options.blocks);
  if (wake_ups.welcomed() < expected || wake_ups.alone.late.empty() || wake_ups.observed.late.empty()) {
    throw std::runtime_error(std::to_string(wake_ups.welcomed()) + " sessions were opened, " +
                             std::to_string(expected) + " expected");
  }
  const auto line = [&](const std::string& what, const Figures& figures) {
    const double span = 1e-3 * options.block_ms * options.blocks;
    const auto steps = static_cast<double>(figures.late.size());
    Row row{.section = {},
            .what = what,
            .unit = "µs",
            .n = figures.late.size(),
            .p50 = quantile(figures.late, 0.5),
            .p99 = quantile(figures.late, 0.99),
            .floor = "a thread that only sleeps",
            .floor_p50 = quantile(wake_ups.asleep.late, 0.5),
            .floor_p99 = quantile(wake_ups.asleep.late, 0.99),
            .note = {}};
    row.ratio = row.p50 / *row.floor_p50;
    char note[220];
    std::snprintf(note, sizeof note,
                  "%llu overruns; %.0f datagrams/s out; processor time for each step: network thread %.1f µs, guests "
                  "%.1f µs%s",
                  static_cast<unsigned long long>(figures.overruns), static_cast<double>(figures.datagrams) / span,
                  1e6 * seconds(figures.network_thread) / steps, 1e6 * seconds(figures.guests) / steps,
                  wake_ups.realtime ? "" : "; without real-time priority");
    row.note = note;
    run.add(row);
  };
  line("haptic thread, a controller alone", wake_ups.alone);
  line("haptic thread, and " + std::to_string(options.observers) + " observers", wake_ups.observed);
}

}  // namespace tendon::bench
