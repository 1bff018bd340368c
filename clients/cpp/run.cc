// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/run.h"

#include <sys/random.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "clients/cpp/udp_transport.h"

namespace tendon {
namespace {

/// Longest sleep: a signal that slips in just before the sleep is noticed after it.
constexpr Duration kLongestWait = std::chrono::milliseconds(100);

volatile std::sig_atomic_t stop_asked = 0;

/// SIGINT and SIGTERM ask for a stop; a second one of the same kind ends the process as usual.
class StopSignals {
 public:
  StopSignals() {
    stop_asked = 0;
    struct sigaction action {};
    action.sa_handler = [](int) { stop_asked = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
  }
  ~StopSignals() {
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
};

LocalTime read_clock() { return LocalTime(std::chrono::steady_clock::now().time_since_epoch()); }

Seed seed_from_system() {
  Seed seed;
  if (getrandom(seed.bytes.data(), seed.bytes.size(), 0) != static_cast<ssize_t>(seed.bytes.size())) {
    throw std::runtime_error("the system gives no random numbers");
  }
  return seed;
}

double milliseconds(Duration d) { return 1e3 * seconds(d); }

/// Refusals that another attempt does not change.
bool final(Code code) { return code != Code::kBusy && code != Code::kShutdown; }

/// The connection's state in a sentence; empty when there is nothing to say.
std::string sentence(const ForceClient& client, const Options& options) {
  const ForceClient::Stats stats = client.stats();
  const std::string server = to_string(options.server);
  switch (stats.phase) {
    case ForceClient::Phase::kOpen:
      return "connected to " + client.welcome()->device_name + " at " + server + " (" + client.welcome()->server +
             ", " + std::to_string(client.welcome()->loop_hz) + " Hz)";
    case ForceClient::Phase::kUnanswered:
      return "no answer from " + server + "; is tendond running there" +
             (options.client.key ? ", and does it have this key" : "") + "? Trying on";
    case ForceClient::Phase::kRefused:
      return server + " refuses: " + stats.reason + (final(stats.code) ? "" : "; trying on");
    case ForceClient::Phase::kLost:
      return "lost " + server + ": " + stats.reason + "; trying on";
    case ForceClient::Phase::kStopped:
      return stats.code == Code::kReplaced ? server + " has ended this: " + stats.reason : "";
    case ForceClient::Phase::kGreeting:
      return {};
  }
  return {};
}

void print_summary(const ForceClient::Stats& stats, Duration duration, const Options& options) {
  using ull = unsigned long long;
  const LinkStats& link = stats.link;
  if (options.json) {
    std::printf(
        "{\"summary\":{\"duration_s\":%.3f,\"sessions\":%llu,\"states\":%llu,\"states_skipped\":%llu,\"forces\":%llu,"
        "\"forces_unusable\":%llu,\"lost_incoming\":%llu,\"lost_outgoing\":%llu,\"round_trip_ms\":%.3f,"
        "\"round_trip_variation_ms\":%.3f}}\n",
        seconds(duration), ull{stats.sessions}, ull{stats.states}, ull{stats.states_skipped}, ull{stats.forces},
        ull{stats.forces_unusable}, ull{link.lost}, ull{link.lost_outgoing}, milliseconds(link.smoothed_round_trip),
        milliseconds(link.round_trip_variation));
  } else if (stats.sessions == 0) {
    std::fprintf(stderr, "%s: was not connected\n", options.client.name.c_str());
  } else {
    std::fprintf(stderr,
                 "%s: %.1f s, %llu states came in (%llu skipped for a newer one), %llu forces went out (%llu more were "
                 "unusable), lost on the way: %llu in, %llu out, round trip %.2f ± %.2f ms\n",
                 options.client.name.c_str(), seconds(duration), ull{stats.states}, ull{stats.states_skipped},
                 ull{stats.forces}, ull{stats.forces_unusable}, ull{link.lost}, ull{link.lost_outgoing},
                 milliseconds(link.smoothed_round_trip), milliseconds(link.round_trip_variation));
  }
}

/// What the server says of our forces, each time that it says it.
void print_report(const LinkReport& report, const Options& options) {
  using ull = unsigned long long;
  if (options.json) {
    const auto delays = [](const char* name, const std::optional<Delays>& d) {
      if (d)
        std::printf(",\"%s_ms\":{\"median\":%.3f,\"p99\":%.3f}", name, milliseconds(d->median), milliseconds(d->p99));
    };
    std::printf(
        "{\"report\":{\"number\":%llu,\"forces\":%llu,\"late_server\":%llu,\"late_network\":%llu,\"late_engine\":%llu,"
        "\"worst_late_ms\":%.3f,\"longest_gap_ms\":%.3f",
        ull{report.number}, ull{report.forces}, ull{report.late_server}, ull{report.late_network},
        ull{report.late_engine}, milliseconds(report.worst_late), milliseconds(report.longest_gap));
    delays("round_trip", report.round_trip);
    delays("to_server", report.to_server);
    delays("to_client", report.to_client);
    std::printf(",\"clock_error_ms\":%.3f,\"received\":%llu,\"lost\":%llu,\"reordered\":%llu,\"duplicated\":%llu}}\n",
                milliseconds(report.clock_error), ull{report.received}, ull{report.lost}, ull{report.reordered},
                ull{report.duplicated});
    std::fflush(stdout);
  } else if (!report.words.empty()) {
    std::fprintf(stderr, "%s: the server says: %s\n", options.client.name.c_str(), report.words.c_str());
  }
}

template <typename Callback>
int run_with(const Options& options, Callback callback) {
  const auto say = [&](const std::string& text) { std::cerr << options.client.name << ": " << text << '\n'; };
  try {
    const StopSignals signals;
    UdpTransport transport(options.server);
    ForceClient::Config config = options.client;
    config.seed = seed_from_system();
    const LocalTime start = read_clock();
    const LocalTime end = options.duration > Duration::zero() ? start + options.duration : LocalTime::max();
    ForceClient client(transport, options.server, config, std::move(callback), start);

    std::string said;
    PeerTime reported{};
    LocalTime now = start;
    while (now < end && stop_asked == 0) {
      const LocalTime next = std::min(client.turn(now), end);
      if (const std::string text = sentence(client, options); !text.empty() && text != said) say(said = text);
      if (const auto& report = client.report()) {
        if (std::exchange(reported, report->until) != report->until) print_report(*report, options);
      }
      if (client.phase() == ForceClient::Phase::kRefused && final(client.stats().code)) return 1;
      if (client.phase() == ForceClient::Phase::kStopped) return 1;
      transport.wait(std::min(next - now, kLongestWait));
      now = read_clock();
    }
    client.stop(now);
    const ForceClient::Stats stats = client.stats();
    print_summary(stats, now - start, options);
    return stats.sessions > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    say(error.what());
    return 1;
  }
}

}  // namespace

int run(const Options& options, Physics physics) { return run_with(options, std::move(physics)); }
int run(const Options& options, Watch watch) { return run_with(options, std::move(watch)); }

}  // namespace tendon
