// SPDX-License-Identifier: Apache-2.0
// tendon-inject: a replayable bad network as a UDP proxy, between any client and any server.
// The network is Proxy; here are its sockets, its clock, its command line and its reports.
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "server/clock.h"
#include "server/doorbell.h"
#include "server/udp_link.h"
#include "tests/injector/duration_histogram.h"
#include "tests/injector/named_profiles.h"
#include "tests/injector/proxy.h"

namespace tendon::injector {
namespace {

/// Datagrams read from one socket in one turn: those that are due must not wait behind a flood.
constexpr int kMaxReceivesPerTurn = 64;

/// Any UDP datagram fits, so that those beyond the protocol's limit reach the server as they are.
constexpr std::size_t kLargestDatagram = 65'536;

/// Later than this at p99, and the proxy has bent the network that it was asked for: at a haptic
/// period of 1 ms a force would slip into the next step.
constexpr Duration kAlarmingReleaseError = std::chrono::milliseconds(1);

struct Options {
  Address listen;
  ProxyOptions proxy;
  std::optional<Duration> duration;
  bool json = false;
};

/// Set by the signal handler.
volatile std::sig_atomic_t stop_requested = 0;
Doorbell* stop_bell = nullptr;

void request_stop(int /*signal*/) {
  stop_requested = 1;
  stop_bell->ring();
}

/// Not through CLI11: it takes -1 for 2⁶⁴ − 1.
std::uint64_t parse_seed(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, seed);
  if (error != std::errc{} || stop != end) {
    throw std::invalid_argument("--seed: expected a whole number from 0 to 18446744073709551615, got \"" + text + "\"");
  }
  return seed;
}

/// Throws CLI::ParseError or std::invalid_argument when the command line is wrong.
Options parse_command_line(int argc, char** argv) {
  CLI::App app(
      "A replayable bad network as a UDP proxy, between any client and any server on this machine.\n"
      "Prints the seed of every run: the same seed and the same traffic meet the same fates.",
      "tendon-inject");
  app.footer(
      "Example: 20 ms ± 5 ms each way, one datagram in fifty lost; clients connect to port 47101\n"
      "  tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile 'delay=uniform(15ms,25ms) loss=2%' "
      "--seed 7\n"
      "\nExit: 0 stopped by --duration-s, SIGINT or SIGTERM; 1 failed while running; 2 wrong usage.");
  std::string listen;
  std::string to;
  std::string seed;
  std::optional<double> duration_s;
  Options options;
  app.add_option("--listen", listen, "where clients send to (port 0: any free one)")
      ->type_name("HOST:PORT")
      ->required();
  app.add_option("--to", to, "the server")->type_name("HOST:PORT")->required();
  app.add_option("--seed", seed, "seed of all random draws; picked and printed when not given")->type_name("N");
  app.add_option("--duration-s", duration_s, "stop after this time")
      ->type_name("S")
      ->check(CLI::Range(1e-3, 1e9).description(""));
  app.add_flag("--json", options.json, "one JSON object per line on stdout, each second and at the end");
  std::string both;
  std::string up;
  std::string down;
  app.add_option("--profile", both,
                 "the network: a name (" + names_of_profiles() + ") or a line like 'delay=20ms loss=2%'")
      ->type_name("LINE|NAME");
  app.add_option("--up", up, "client to server, where it differs")->type_name("LINE|NAME");
  app.add_option("--down", down, "server to client, where it differs")->type_name("LINE|NAME");

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    app.exit(help);
    throw;
  }
  const auto address = [](const char* option, const std::string& text) {
    try {
      return parse_address(text);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(std::string(option) + ": " + error.what());
    }
  };
  options.listen = address("--listen", listen);
  options.proxy.server = address("--to", to);
  if (!is_loopback(options.proxy.server) || options.proxy.server.port == 0) {
    throw std::invalid_argument("--to: expected a loopback address with a port, got " + to +
                                ": the only cipher suite so far is `plain`, which servers accept on loopback only");
  }
  if (options.listen == options.proxy.server) {
    throw std::invalid_argument("--to: expected another address than --listen, got " + to + " for both");
  }
  const auto profile = [&](const char* option, const std::string& own, Direction direction) {
    try {
      return resolve_profile(own.empty() ? both : own, direction);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(std::string(own.empty() ? "--profile" : option) + ": " + error.what());
    }
  };
  options.proxy.up = profile("--up", up, Direction::kUp);
  options.proxy.down = profile("--down", down, Direction::kDown);
  options.proxy.seed = seed.empty() ? std::random_device{}() : parse_seed(seed);
  if (duration_s) options.duration = from_seconds(*duration_s);
  return options;
}

/// The sockets around a Proxy, and the loop that turns them.
class Runner {
 public:
  explicit Runner(const Options& options)
      : options_(options), proxy_(options.proxy), listener_(options.listen), buffer_(kLargestDatagram) {}

  Doorbell& stop_bell() { return stop_bell_; }

  void run() {
    start_ = clock::now();
    report_start();
    LocalTime now = start_;
    LocalTime next_report = start_ + kReportPeriod;
    const LocalTime end = options_.duration ? start_ + *options_.duration : LocalTime::max();
    while (stop_requested == 0 && now < end) {
      wait_until(std::min({proxy_.next_wake().value_or(LocalTime::max()), next_report, end}));
      now = clock::now();
      turn(now);
      if (now >= next_report) {
        report("report", now);
        next_report += kReportPeriod * ((now - next_report) / kReportPeriod + 1);
      }
    }
    report("end", now);
  }

 private:
  static constexpr Duration kReportPeriod = std::chrono::seconds(1);

  /// Until a socket is readable, the bell rings or `deadline`. Deciding how long to sleep is the one
  /// use of the time besides `now` of the turn: a turn's own length must not delay the next release.
  void wait_until(LocalTime deadline) {
    fds_.assign({pollfd{stop_bell_.fd(), POLLIN, 0}, pollfd{listener_.fd(), POLLIN, 0}});
    for (const auto& [client, link] : upstream_) fds_.push_back({link.fd(), POLLIN, 0});
    const Duration left = std::max(deadline - clock::now(), Duration::zero());
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
    const timespec time{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
    if (::ppoll(fds_.data(), fds_.size(), &time, nullptr) < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "ppoll");
    }
  }

  void turn(LocalTime now) {
    Address from;
    for (int i = 0; i < kMaxReceivesPerTurn; ++i) {
      const std::size_t size = listener_.receive(from, buffer_);
      if (size == 0) break;
      const auto client = proxy_.receive_from_client(from, std::span(buffer_).first(size), now);
      if (client && !upstream_.contains(*client)) {
        Address any_port = options_.proxy.server;  // on the server's loopback, so of its address family
        any_port.port = 0;
        upstream_.try_emplace(*client, any_port);
        log("client " + std::to_string(*client) + " is " + to_string(from));
      }
    }
    for (auto& [client, link] : upstream_) {
      for (int i = 0; i < kMaxReceivesPerTurn; ++i) {
        const std::size_t size = link.receive(from, buffer_);
        if (size == 0) break;
        proxy_.receive_from_server(client, from, std::span(buffer_).first(size), now);
      }
    }
    while (const auto departure = proxy_.next_due(now)) {
      UdpLink& link = departure->direction == Direction::kUp ? upstream_.at(departure->client) : listener_;
      link.send(departure->to, departure->datagram);
      release_errors_[static_cast<std::size_t>(departure->direction)].observe(now - departure->due);
    }
    while (const auto client = proxy_.next_evicted(now)) {
      closed_send_failures_ += upstream_.at(*client).send_failures();
      upstream_.erase(*client);
      log("client " + std::to_string(*client) + " has been silent and is forgotten");
    }
  }

  std::uint64_t send_failures() const {
    std::uint64_t sum = closed_send_failures_ + listener_.send_failures();
    for (const auto& [client, link] : upstream_) sum += link.send_failures();
    return sum;
  }

  static void log(const std::string& line) { std::cerr << "tendon-inject: " + line + "\n"; }

  void report_start() {
    const std::string listen = to_string(listener_.local_address());
    const std::string to = to_string(options_.proxy.server);
    const std::string seed = std::to_string(options_.proxy.seed);
    const std::string up = to_string(options_.proxy.up);
    const std::string down = to_string(options_.proxy.down);
    if (options_.json) {
      std::cout << R"({"event":"start","listen":")" << listen << R"(","to":")" << to << R"(","seed":)" << seed
                << R"(,"up":")" << up << R"(","down":")" << down << "\"}" << std::endl;
    } else {
      std::cout << "tendon-inject: " << listen << " -> " << to << ", seed " << seed << "\n  up:   " << up
                << "\n  down: " << down << std::endl;
    }
  }

  static double us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

  std::string direction_json(Direction direction) const {
    const ProxyCounters& n = proxy_.counters(direction);
    const DurationHistogram& error = release_errors_[static_cast<std::size_t>(direction)];
    std::ostringstream out;
    out << R"({"received":)" << n.received << R"(,"forwarded":)" << n.forwarded << R"(,"lost":)" << n.lost
        << R"(,"duplicated":)" << n.duplicated << R"(,"refused":)" << n.refused << R"(,"release_error_us":{"p50":)"
        << us(error.quantile(0.5)) << R"(,"p99":)" << us(error.quantile(0.99)) << R"(,"max":)" << us(error.max())
        << "}}";
    return out.str();
  }

  std::string direction_text(Direction direction) const {
    const ProxyCounters& n = proxy_.counters(direction);
    const DurationHistogram& error = release_errors_[static_cast<std::size_t>(direction)];
    std::ostringstream out;
    out << n.received << " in, " << n.forwarded << " forwarded, " << n.lost << " lost, " << n.duplicated
        << " duplicated, " << n.refused << " refused; released late by p50 " << us(error.quantile(0.5)) << ", p99 "
        << us(error.quantile(0.99)) << ", max " << us(error.max()) << " us";
    return out.str();
  }

  /// `event` is "report" (each second) or "end".
  void report(const std::string& event, LocalTime now) {
    const double t_s = seconds(now - start_);
    if (options_.json) {
      std::cout << R"({"event":")" << event << R"(","t_s":)" << t_s << R"(,"seed":)" << options_.proxy.seed
                << R"(,"clients":)" << proxy_.clients() << R"(,"in_flight":)" << proxy_.in_flight()
                << R"(,"send_failures":)" << send_failures() << R"(,"up":)" << direction_json(Direction::kUp)
                << R"(,"down":)" << direction_json(Direction::kDown) << "}" << std::endl;
    } else if (event == "end") {
      std::cout << "after " << t_s << " s, seed " << options_.proxy.seed << ", " << proxy_.in_flight()
                << " still on their way, " << send_failures()
                << " send failures\n  up:   " << direction_text(Direction::kUp)
                << "\n  down: " << direction_text(Direction::kDown) << std::endl;
    } else if (stderr_is_terminal_) {
      std::cerr << "\r" << t_s << " s: " << proxy_.clients() << " clients, "
                << proxy_.counters(Direction::kUp).forwarded << " up, " << proxy_.counters(Direction::kDown).forwarded
                << " down " << std::flush;
    }
    if (event == "end") {
      for (const DurationHistogram& error : release_errors_) {
        if (error.quantile(0.99) <= kAlarmingReleaseError) continue;
        log("warning: one datagram in a hundred left more than 1 ms late, so the network was not the one asked for");
        break;
      }
    }
  }

  Options options_;
  Proxy proxy_;
  UdpLink listener_;
  std::map<ClientIndex, UdpLink> upstream_;
  Doorbell stop_bell_;
  std::vector<std::byte> buffer_;
  std::vector<pollfd> fds_;
  std::array<DurationHistogram, 2> release_errors_;  // by Direction
  std::uint64_t closed_send_failures_ = 0;
  LocalTime start_{};
  bool stderr_is_terminal_ = ::isatty(STDERR_FILENO) == 1;
};

int wrong_usage(const std::exception& error) {
  std::cerr << "tendon-inject: " << error.what() << "\n";
  return 2;
}

int main(int argc, char** argv) {
  std::optional<Runner> runner;
  try {
    runner.emplace(parse_command_line(argc, argv));
  } catch (const CLI::Success&) {
    return 0;  // --help has been printed
  } catch (const std::exception& error) {
    return wrong_usage(error);  // an address that cannot be listened on is one, too
  }
  stop_bell = &runner->stop_bell();
  struct sigaction action {};
  action.sa_handler = request_stop;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // By default the kernel may wake us 50 µs late to save power; here lateness is the measured error.
  prctl(PR_SET_TIMERSLACK, 1UL);
  try {
    runner->run();
  } catch (const std::exception& error) {
    std::cerr << "tendon-inject: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace tendon::injector

int main(int argc, char** argv) { return tendon::injector::main(argc, argv); }
