// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/live_run.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <deque>
#include <exception>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/machine/output.h"
#include "tests/tools/injector/proxy/control_socket.h"
#include "tests/tools/injector/proxy/driver.h"
#include "tests/tools/injector/proxy/real_time.h"
#include "tests/tools/injector/proxy/terminal.h"
#include "tests/tools/injector/proxy/terminal_view.h"
#include "tests/tools/injector/proxy/udp_batch.h"
#include "tests/tools/injector/traces/trace_recorder.h"

namespace tendon::injector {
namespace {

constexpr Duration kRedrawPeriod = std::chrono::milliseconds(200);
constexpr Duration kReportPeriod = std::chrono::seconds(1);
constexpr Duration kRefusedPeriod = std::chrono::seconds(10);

std::atomic<Driver*> driver_to_stop = nullptr;

void request_stop(int /*signal*/) {
  if (Driver* const driver = driver_to_stop) driver->stop();
}

class Signals {
 public:
  explicit Signals(Driver& driver) {
    driver_to_stop = &driver;
    struct sigaction stop {};
    stop.sa_handler = request_stop;
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGINT, &stop, &before_[0]);
    ::sigaction(SIGTERM, &stop, &before_[1]);
    ::sigaction(SIGPIPE, &ignore, &before_[2]);
  }
  ~Signals() {
    ::sigaction(SIGINT, &before_[0], nullptr);
    ::sigaction(SIGTERM, &before_[1], nullptr);
    ::sigaction(SIGPIPE, &before_[2], nullptr);
    driver_to_stop = nullptr;
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

 private:
  std::array<struct sigaction, 3> before_{};
};

class DriverThread {
 public:
  explicit DriverThread(Driver& driver)
      : driver_(driver), ended_(::eventfd(0, EFD_CLOEXEC)), thread_([this] { run(); }) {}
  ~DriverThread() {
    driver_.stop();
    if (thread_.joinable()) thread_.join();
    ::close(ended_);
  }
  DriverThread(const DriverThread&) = delete;
  DriverThread& operator=(const DriverThread&) = delete;

  int fd() const { return ended_; }
  void join() {
    thread_.join();
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void run() {
    try {
      driver_.run();
    } catch (...) {
      error_ = std::current_exception();
    }
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(ended_, &one, sizeof one);
  }

  Driver& driver_;
  int ended_;
  std::exception_ptr error_;
  std::thread thread_;
};

std::vector<Address> addresses_of(const LiveRun& options) {
  const std::vector<Address> addresses = options.server.look_up().addresses;
  if (addresses.front().port == 0) {
    throw std::invalid_argument("--to: expected a port other than 0, got " + options.server.text());
  }
  std::vector<Address> reachable;
  std::string problem;
  for (const Address& address : addresses) {
    if (address == options.listen) {
      throw std::invalid_argument("--to: expected a different address than --listen, got " + options.server.text() +
                                  " for both");
    }
    try {
      UdpBatch::connected(address);
      reachable.push_back(address);
    } catch (const std::runtime_error& error) {
      if (problem.empty()) problem = error.what();
    }
  }
  if (reachable.empty()) throw std::runtime_error(problem);
  return reachable;
}

Driver::Config driver_config(const PreparedNetwork& network, const LiveRun& options,
                             const std::vector<Address>& servers) {
  return {.listen = options.listen,
          .servers = servers,
          .proxy = {.networks = network.networks,
                    .timeline = network.timeline,
                    .replay = network.replay.get(),
                    .playback = network.playback,
                    .record = !options.record.empty(),
                    .max_clients = options.max_clients},
          .spin = options.spin,
          .realtime = options.realtime,
          .duration = options.duration};
}

class Conversation {
 public:
  Conversation(const PreparedNetwork& network, const LiveRun& options, const Address& server, Driver& driver,
               TraceRecorder* recorder)
      : network_(network), options_(options), driver_(driver), recorder_(recorder), server_(server) {
    heading_ = {to_string(driver.local_address()), options.server.at(server), network.seed, network.text,
                options.max_release_error};
    if (!options.control.empty()) control_.emplace(options.control);
    if (!options.json) terminal_ = Terminal::take();
    said_.emplace_back();
  }

  void begin() {
    if (options_.json) {
      std::cout << JsonLine()
                       .add("event", "start")
                       .add("listen", heading_.listen)
                       .add("to", heading_.server)
                       .add("seed", heading_.seed)
                       .add("up", network_.text[0])
                       .add("down", network_.text[1])
                       .str()
                << std::endl;
    } else if (!terminal_) {
      std::cout << "tendon-inject: " << heading_.listen << " -> " << heading_.server << ", seed " << heading_.seed
                << "\n  up:   " << network_.text[0] << "\n  down: " << network_.text[1] << std::endl;
    }
  }

  void run_until(int ended) {
    const Duration period = terminal_ ? kRedrawPeriod : kReportPeriod;
    LocalTime next = monotonic_now() + period;
    for (;;) {
      std::vector<pollfd> fds = {{ended, POLLIN, 0}};
      if (terminal_) fds.push_back({Terminal::fd(), POLLIN, 0});
      if (control_) control_->wait_for(fds);
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - monotonic_now());
      ::poll(fds.data(), fds.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
      if (fds.front().revents != 0) return;
      if (control_) control_->turn([this](std::string_view line) { return answer(line); });
      if (terminal_) listen_to_user();
      const LocalTime now = monotonic_now();
      if (now < next) continue;
      next += period * ((now - next) / period + 1);
      report();
    }
  }

  bool end() {
    const Status last = driver_.status();
    tell(last);
    const bool tells = !terminal_ && is_unanswered(last);
    if (terminal_) {
      draw(last);
      terminal_.reset();
    }
    if (options_.json) {
      say("end", last);
    } else {
      std::cout << end_text(heading_, last) << std::flush;
    }
    if (tells) std::cerr << "tendon-inject: no answer from " << heading_.server << ": is a server there?\n";
    return why_invalid(last, options_.max_release_error).empty();
  }

 private:
  void say(const char* event, const Status& status) {
    JsonLine line;
    line.add("event", event).add("seed", heading_.seed).add_all(in_json(status, options_.max_release_error));
    std::cout << line.str() << std::endl;
  }

  void report() {
    Status status = driver_.status();
    tell(status);
    if (terminal_) {
      draw(status);
    } else if (options_.json) {
      say("report", status);
    } else {
      std::cout << log_line(status, said_.back()) << std::endl;
    }
    // The terminal shows the last second, a report the time since the previous report.
    said_.push_back(std::move(status));
    while (said_.size() > 1 && (!terminal_ || said_.back().elapsed - said_[1].elapsed >= kReportPeriod)) {
      said_.pop_front();
    }
  }

  void draw(const Status& status) {
    const std::string typed = terminal_->typed().empty() ? said_to_user_ : terminal_->typed();
    terminal_->draw(terminal_view(heading_, status, said_.front(), typed, terminal_->columns()));
  }

  void tell(const Status& status) {
    note_changes(status);
    if (status.server != server_) {
      const std::string silent = std::exchange(heading_.server, options_.server.at(status.server));
      server_ = status.server;
      if (!terminal_) std::cerr << "tendon-inject: no answer from " << silent << ", trying " << heading_.server << "\n";
    }
    if (terminal_) return;
    tell_of_clients(status);
    tell_of_refused(status);
  }

  void tell_of_refused(const Status& status) {
    const std::uint64_t refused = status.of(Direction::kUp).counters.refused_clients;
    const LocalTime now = monotonic_now();
    if (refused == told_refused_ || now < tell_refused_) return;
    std::cerr << "tendon-inject: " << refused - std::exchange(told_refused_, refused)
              << " datagrams of further clients refused: ";
    if (status.no_socket.empty()) {
      std::cerr << options_.max_clients << " clients are the maximum (--max-clients); a client is removed after "
                << seconds(Proxy::kIdleTimeout) << " s of silence\n";
    } else {
      std::cerr << status.no_socket << "\n";
    }
    tell_refused_ = now + kRefusedPeriod;
  }

  void tell_of_clients(const Status& status) {
    for (const Proxy::ClientSummary& client : status.clients) {
      if (client.index < known_clients_) continue;
      known_clients_ = client.index + 1;
      std::cerr << "tendon-inject: client " << client.index << " is " << to_string(client.address) << "\n";
    }
  }

  void note_changes(const Status& status) {
    for (; noted_ < status.scenario_done; ++noted_) {
      if (recorder_ != nullptr) recorder_->note(network_.timeline[noted_].change.text);
    }
  }

  void listen_to_user() {
    while (const auto line = terminal_->next_line()) {
      said_to_user_ = line->empty() ? "" : *line + ": " + answer(*line);
    }
    draw(driver_.status());
  }

  std::string answer(std::string_view line) {
    try {
      return execute(line);
    } catch (const std::exception& error) {
      return std::string("error: ") + error.what();
    }
  }

  std::string execute(std::string_view line);

  const PreparedNetwork& network_;
  const LiveRun& options_;
  Driver& driver_;
  TraceRecorder* recorder_;
  Heading heading_;
  std::optional<ControlSocket> control_;
  std::unique_ptr<Terminal> terminal_;
  std::deque<Status> said_;
  std::string said_to_user_;
  Address server_;
  ClientIndex known_clients_ = 0;
  std::uint64_t told_refused_ = 0;
  LocalTime tell_refused_{};
  std::size_t noted_ = 0;
};

std::string Conversation::execute(std::string_view line) {
  const Command command = parse_command(line);
  if (const auto* request = std::get_if<Request>(&command)) {
    switch (*request) {
      case Request::kStats:
        return in_json(driver_.status(), options_.max_release_error).str();
      case Request::kHelp:
        return command_help();
      case Request::kStop:
        driver_.stop();
        return "ok";
    }
  }
  const Change& change = std::get<Change>(command);
  if (network_.replay && (change.up || change.down)) {
    throw std::invalid_argument("the network cannot be changed, because a trace is replayed");
  }
  driver_.change(prepare(change, network_.seed));
  if (recorder_ != nullptr) recorder_->note(change.text);
  if (options_.json) {
    std::cout << JsonLine().add("event", "change").add("change", change.text).str() << std::endl;
  }
  return "ok";
}

}  // namespace

int live_run(const PreparedNetwork& network, const LiveRun& options) {
  const std::vector<Address> servers = addresses_of(options);
  std::optional<TraceRecorder> recorder;
  std::optional<Driver> driver;
  if (!options.record.empty()) recorder.emplace(options.record, network.header());
  driver.emplace(driver_config(network, options, servers), recorder ? &*recorder : nullptr);
  Conversation conversation(network, options, servers.front(), *driver, recorder ? &*recorder : nullptr);
  const UnblockedOutput output;
  const Signals signals(*driver);
  conversation.begin();
  DriverThread thread(*driver);
  conversation.run_until(thread.fd());
  thread.join();
  const bool valid = conversation.end();
  if (recorder) recorder->finish();
  return valid ? 0 : 1;
}

}  // namespace tendon::injector
