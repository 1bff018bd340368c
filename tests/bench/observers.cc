// SPDX-License-Identifier: Apache-2.0
//
// tendon-bench-observers: how late the haptic thread wakes with a controller alone, and with observers besides, who
// cost a datagram each in every step. The two take turns in blocks within one run of one server, whose threads are
// those of tendond: haptic (real-time priority where it is granted), network, and a log that takes records out. The
// observers are in one process, and cost processor time themselves: it is told apart.
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <iostream>
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
#include "tests/lab/json.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kPriority = 70;  // as tendond
/// At the beginning of each block: guests have come or gone.
constexpr Duration kSettle = milliseconds(200);

struct Options {
  std::size_t observers = 32;
  int blocks = 10;  ///< of each kind
  int block_ms = 2000;
  bool json = false;
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
      ::_exit(kDone);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "tendon-bench-observers: %s\n", error.what());
      ::_exit(kFailed);
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
  std::vector<Duration> late;  ///< of each haptic step
  std::uint64_t overruns = 0;
  std::uint64_t datagrams = 0;  ///< that the server has sent
  Duration network_thread{};    ///< processor time
  Duration guests{};            ///< likewise, of their process

  double late_us(std::size_t percent) {
    if (late.empty()) return 0;
    const auto nth = late.begin() + static_cast<std::ptrdiff_t>((late.size() - 1) * percent / 100);
    std::nth_element(late.begin(), nth, late.end());
    return 1e6 * seconds(*nth);
  }
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

class Bench {
 public:
  explicit Bench(const Options& options)
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

  Figures alone, observed;
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
    realtime = enter_realtime(kPriority).empty();
    LocalTime due = clock::now();
    while (!stop_) {
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
        if (into != nullptr) into->late.push_back(step->hand.at - step->scheduled);
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
  std::uint64_t datagrams_ = 0;
};

void print(const char* who, std::size_t observers, Figures& figures, const Options& options) {
  const double seconds_of_all = 1e-3 * options.block_ms * options.blocks;
  const auto steps = static_cast<double>(figures.late.size());
  const double per_s = static_cast<double>(figures.datagrams) / seconds_of_all;
  const double network = 1e6 * seconds(figures.network_thread) / steps;
  const double guests = 1e6 * seconds(figures.guests) / steps;
  if (options.json) {
    std::cout << lab::JsonLine()
                     .add("observers", observers)
                     .add("steps", figures.late.size())
                     .add("late_p50_us", figures.late_us(50))
                     .add("late_p99_us", figures.late_us(99))
                     .add("overruns", figures.overruns)
                     .add("datagrams_per_s", per_s)
                     .add("network_thread_us_per_step", network)
                     .add("guests_us_per_step", guests)
                     .str()
              << '\n';
  } else {
    std::printf(
        "%-20s %7zu steps, late by p50 %6.1f µs, p99 %7.1f µs; %llu overruns; %.0f datagrams/s; processor time for "
        "each "
        "step: network thread %.1f µs, guests %.1f µs\n",
        who, figures.late.size(), figures.late_us(50), figures.late_us(99),
        static_cast<unsigned long long>(figures.overruns), per_s, network, guests);
  }
}

int main_of(int argc, char** argv) {
  CLI::App app("How late the haptic thread wakes with observers and without, in turns", "tendon-bench-observers");
  Options options;
  app.add_option("--observers", options.observers, "besides the controller")->check(CLI::Range(1, 1000));
  app.add_option("--blocks", options.blocks, "of each kind")->check(CLI::Range(1, 10'000));
  app.add_option("--block-ms", options.block_ms, "length of one")->check(CLI::Range(10, 1'000'000));
  app.add_flag("--json", options.json, "one JSON object a line instead of text");
  app.footer(
      "\nExample:\n  tendon-bench-observers --observers 32\n\nExit: 0 done; 1 it could not be measured; 2 wrong "
      "usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  }
  try {
    Bench bench(options);
    bench.run();
    if (!bench.realtime) std::fprintf(stderr, "without real-time priority: expect late steps under load\n");
    print("controller alone", 0, bench.alone, options);
    print(("with " + std::to_string(options.observers) + " observers").c_str(), options.observers, bench.observed,
          options);
    const std::uint64_t expected = 1 + options.observers * static_cast<std::uint64_t>(options.blocks);
    if (bench.welcomed() >= expected && !bench.alone.late.empty() && !bench.observed.late.empty()) return kDone;
    std::fprintf(stderr, "tendon-bench-observers: %llu sessions were opened, %llu expected\n",
                 static_cast<unsigned long long>(bench.welcomed()), static_cast<unsigned long long>(expected));
    return kFailed;
  } catch (const std::exception& error) {
    std::cerr << "tendon-bench-observers: " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace
}  // namespace tendon

int main(int argc, char** argv) { return tendon::main_of(argc, argv); }
