// SPDX-License-Identifier: Apache-2.0
//
// Wake-up latency of the haptic thread with a controller alone; with a recording; with 32 observers, each of which
// receives a datagram per step; and with tendon-dash and a page. The baseline is a thread that only sleeps. All
// alternate in blocks within one run of one server with tendond's threads: haptic (real-time priority if granted),
// network, and a log that pops records. The observers are in a single process, whose processor time is reported
// separately.
#include <arpa/inet.h>
#include <netinet/in.h>
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
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/udp_transport.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/assembly.h"
#include "server/machine/clock.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/e2e/stage/process.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr Duration kSettle = milliseconds(200);

struct Options {
  std::size_t observers = 32;
  int blocks = 60;  ///< number of blocks of each kind, one minute in total
  int block_ms = 1000;
};

/// Wakes once per millisecond and reads for all clients, because 32 wake-ups would cost more than the server.
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
    end_with_parent();
    try {
      serve(server, observers);
      ::_exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "tendon-lab bench: guests: %s\n", error.what());
      ::_exit(1);
    }
  }
  ~Guests() {
    ::close(orders_);  // ends the child
    ::waitpid(child_, nullptr, 0);
  }
  Guests(const Guests&) = delete;
  Guests& operator=(const Guests&) = delete;

  void let_observers_in(bool in) {
    const char order = in ? 'i' : 'o';
    if (::write(orders_, &order, 1) != 1) throw std::runtime_error("the guest processes have ended");
    pollfd fd{orders_, POLLIN, 0};
    char done = 0;
    if (::poll(&fd, 1, 30'000) != 1 || ::read(orders_, &done, 1) != 1) {
      throw std::runtime_error("not all observers were connected within 30 s");
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
      // Observers join one after another: a server handles 16 handshakes at a time.
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

/// The network side of a page: reads a WebSocket at tendon-dash's /live (RFC 6455, section 4.1).
class Page {
 public:
  explicit Page(const std::string& address) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const Address dash = parse_address(address);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(dash.port);
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string hello = "GET /live HTTP/1.1\r\nHost: " + address + "\r\nOrigin: http://" + address +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0 ||
        ::send(socket_, hello.data(), hello.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(hello.size())) {
      const int error = errno;
      ::close(socket_);
      throw std::system_error(error, std::generic_category(), "tendon-dash at " + address);
    }
  }
  ~Page() { ::close(socket_); }
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;

  std::size_t read() {
    std::array<char, 65536> bytes{};
    std::size_t all = 0;
    for (ssize_t size = 1; size > 0; all += static_cast<std::size_t>(std::max<ssize_t>(size, 0))) {
      size = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    }
    return all;
  }

 private:
  int socket_;
};

class Dashboard {
 public:
  Dashboard(const std::filesystem::path& program, const Address& server)
      : process_(program, {"--server", to_string(server), "--listen", "127.0.0.1:0", "--json"}, "/"),
        page_(address_in(process_.wait_for_line("\"listening\""))) {}
  /// Sends SIGTERM, so that the client sends a Bye before the next block.
  ~Dashboard() {
    process_.signal(SIGTERM);
    process_.wait();
  }
  Dashboard(const Dashboard&) = delete;
  Dashboard& operator=(const Dashboard&) = delete;
  std::size_t read() { return page_.read(); }

 private:
  static std::string address_in(const std::string& line) {
    const std::string key = "127.0.0.1:";
    const std::size_t begin = line.find(key);
    return line.substr(begin, line.find_first_not_of("0123456789", begin + key.size()) - begin);
  }

  e2e::Process process_;
  Page page_;
};

class Recording {
 public:
  Recording() : path_(make()), sink_(path_), recorder_({}, sink_) {}
  ~Recording() { std::filesystem::remove(path_); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  Recorder& recorder() { return recorder_; }

 private:
  static std::filesystem::path make() {
    std::string path = (std::filesystem::temp_directory_path() / "tendon-bench-XXXXXX").string();
    const int file = ::mkstemp(path.data());
    if (file < 0) throw std::system_error(errno, std::generic_category(), path);
    ::close(file);
    return path;
  }

  std::filesystem::path path_;
  FileSink sink_;
  Recorder recorder_;
};

std::optional<std::filesystem::path> dashboard_program() {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "tendon-dash";
  return std::filesystem::exists(program) ? std::optional(program) : std::nullopt;
}

enum class Kind { kAlone, kRecorder, kObservers, kDashboard };

struct Figures {
  std::vector<double> late;  ///< µs, of each wake-up
  std::uint64_t overruns = 0;
  std::uint64_t datagrams = 0;  ///< sent by the server
  Duration network_thread{};    ///< processor time
  Duration guests{};            ///< processor time of their process
  std::uint64_t page_bytes = 0;
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
        server_({{.scene = scene_of(device_, options), .device = device_}},
                {.now = clock::now(), .watched = Mailboxes::Capacities{}}, {&link_}) {}

  void run() {
    std::thread network([this] { run_network(); });
    std::thread haptic([this] { run_haptic(); });
    try {
      clockid_t network_clock{};
      clockid_t guests_clock{};
      pthread_getcpuclockid(network.native_handle(), &network_clock);
      clock_getcpuclockid(guests_.pid(), &guests_clock);
      const int kinds = dash_ ? 4 : 3;
      for (int block = 0; block < kinds * options_.blocks; ++block) {
        only_sleep();
        const auto kind = static_cast<Kind>(block % kinds);
        guests_.let_observers_in(kind == Kind::kObservers);
        std::optional<Recording> recording;
        if (kind == Kind::kRecorder) recording.emplace();
        std::optional<Dashboard> dashboard;
        if (kind == Kind::kDashboard) dashboard.emplace(*dash_, link_.local_address());
        const auto look = [&](Duration lasts, Figures* into) {
          watch(lasts, recording ? &recording->recorder() : nullptr, dashboard ? &*dashboard : nullptr, into);
        };
        look(kSettle, nullptr);
        Figures& figures = of[static_cast<std::size_t>(kind)];
        const std::uint64_t overruns = haptic_overruns();
        const std::uint64_t sent = datagrams_;
        const Duration network_before = read(network_clock);
        const Duration guests_before = read(guests_clock);
        look(milliseconds(options_.block_ms), &figures);
        figures.overruns += haptic_overruns() - overruns;
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

  Figures asleep;
  std::array<Figures, 4> of;  ///< indexed by Kind
  bool realtime = true;
  std::uint64_t welcomed() { return server_.network().stats().welcomed; }

 private:
  static Scene scene_of(const SimulatedDevice& device, const Options& options) {
    Scene scene;
    scene.name = "device";
    HapticController::Config& control = scene.loop.control;
    control.limiter.friction = {0.3, 0.8};
    control.limiter.longest_hold = milliseconds(2);
    control.max_force = device.info().max_force;
    control.max_slew = 1000;
    scene.network.max_observers = options.observers + 1;
    return scene;
  }

  std::uint64_t haptic_overruns() { return server_.devices().front().haptic.stats().overruns; }

  void run_haptic() {
    realtime = enter_realtime(kHapticPriority).empty();
    LocalTime due = clock::now();
    while (!stop_) {
      if (resting_) {
        clock::sleep_until(clock::now() + milliseconds(1));
        due = clock::now();
        continue;
      }
      due = server_.haptic_groups().front().turn(clock::now());
      stepped_.ring();
      clock::sleep_until(due);
    }
    server_.haptic_groups().front().stop();
  }

  void run_network() {
    enter_punctual();
    LocalTime due = clock::now();
    while (!stop_) {
      const LocalTime before = clock::now();
      if (due > before) link_.wait(std::min<Duration>(due - before, std::chrono::seconds(1)), &stepped_);
      due = server_.turn_network(0, clock::now());
    }
    server_.network().close(clock::now());
  }

  /// Baseline: a thread like the haptic one that only sleeps, while the haptic thread is idle.
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

  /// The log thread: pops records and collects wake-up latencies.
  void watch(Duration lasts, Recorder* recorder, Dashboard* dashboard, Figures* into) {
    Mailboxes& mail = server_.devices().front().mail;
    for (const LocalTime end = clock::now() + lasts; clock::now() < end;) {
      while (const StepRecord* step = mail.steps.front()) {
        if (into != nullptr) into->late.push_back(1e6 * seconds(step->hand.at - step->scheduled));
        if (recorder != nullptr) recorder->record(*step, 0);
        mail.steps.pop();
      }
      while (const DatagramRecord* record = mail.datagrams.front()) {
        datagrams_ += record->direction == DatagramRecord::Direction::kOut ? 1 : 0;
        if (recorder != nullptr) recorder->record(*record);
        mail.datagrams.pop();
      }
      const std::size_t page_bytes = dashboard != nullptr ? dashboard->read() : 0;
      if (into != nullptr) into->page_bytes += page_bytes;
      if (recorder != nullptr) recorder->tick(clock::now());
      clock::sleep_until(clock::now() + milliseconds(20));
    }
  }

  Options options_;
  std::optional<std::filesystem::path> dash_ = dashboard_program();
  SimulatedDevice device_;
  UdpLink link_{parse_address("127.0.0.1:0")};
  Guests guests_;  // forks before threads are started
  Doorbell stepped_;
  Assembly server_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> resting_{false};  ///< the haptic thread is idle
  std::uint64_t datagrams_ = 0;
};

}  // namespace

void measure_wake_ups(Run& run) {
  Options options;
  if (run.options.quick) options = {.observers = 3, .blocks = 1, .block_ms = 50};
  WakeUps wake_ups(options);
  wake_ups.run();
  ::munlockall();  // undoes enter_realtime
  const std::uint64_t expected = 1 + options.observers * static_cast<std::uint64_t>(options.blocks);
  if (wake_ups.welcomed() < expected || wake_ups.of[0].late.empty() || wake_ups.of[2].late.empty()) {
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
  const auto of = [&](Kind kind) -> const Figures& { return wake_ups.of[static_cast<std::size_t>(kind)]; };
  line("haptic thread, a controller alone", of(Kind::kAlone));
  line("… and a recording", of(Kind::kRecorder));
  line("… and " + std::to_string(options.observers) + " observers", of(Kind::kObservers));
  const Figures& dashboard = of(Kind::kDashboard);
  if (dashboard.late.empty()) return;  // tendon-dash is not built
  if (dashboard.page_bytes == 0) throw std::runtime_error("tendon-dash sent no data to its page");
  line("… and tendon-dash with a page", dashboard);
}

}  // namespace tendon::bench
