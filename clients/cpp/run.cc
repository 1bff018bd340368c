// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/run.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "clients/cpp/machine.h"
#include "clients/cpp/udp_transport.h"

namespace tendon {
namespace {

using Json = nlohmann::ordered_json;  // members in the order in which they are written here

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

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

/// One object in one line of stdout.
void say_json(const Json& json) { std::cout << json << std::endl; }

/// Whether another attempt would be refused too.
bool is_final(Code code) { return code != Code::kBusy && code != Code::kShutdown; }

/// The connection's state in a sentence; empty when there is nothing to say.
std::string sentence(const ForceClient& client, const Address& address, const Options& options) {
  const ForceClient::Stats stats = client.stats();
  const std::string server = options.server.at(address);
  switch (stats.phase) {
    case ForceClient::Phase::kOpen:
      return "connected to " + client.welcome()->device_name + " at " + server + " (" + client.welcome()->server +
             ", " + std::to_string(client.welcome()->loop_hz) + " Hz)";
    case ForceClient::Phase::kUnanswered:
      return "no answer from " + server + "; is tendond running there" +
             (options.client.key ? ", and does it have this key" : "") + "? Trying on";
    case ForceClient::Phase::kRefused:
      return server + " refuses: " + stats.reason + (is_final(stats.code) ? "" : "; trying again");
    case ForceClient::Phase::kLost:
      return "lost " + server + ": " + stats.reason + "; trying again";
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
    say_json({{"summary",
               {{"duration_s", seconds(duration)},
                {"sessions", stats.sessions},
                {"states", stats.states},
                {"states_skipped", stats.states_skipped},
                {"forces", stats.forces},
                {"forces_unusable", stats.forces_unusable},
                {"lost_incoming", link.lost},
                {"lost_outgoing", link.lost_outgoing},
                {"round_trip_ms", milliseconds(link.smoothed_round_trip)},
                {"round_trip_variation_ms", milliseconds(link.round_trip_variation)}}}});
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
  if (options.json) {
    Json json = {{"number", report.number},
                 {"forces", report.forces},
                 {"late_server", report.late_server},
                 {"late_network", report.late_network},
                 {"late_engine", report.late_engine},
                 {"late_unknown", report.late_unknown},
                 {"refused",
                  {{"not_finite", report.refused.not_finite},
                   {"out_of_bounds", report.refused.out_of_bounds},
                   {"unknown_tick", report.refused.unknown_tick},
                   {"old_sequence", report.refused.old_sequence}}},
                 {"worst_late_ms", milliseconds(report.worst_late)},
                 {"longest_gap_ms", milliseconds(report.longest_gap)}};
    const auto add = [&](const char* name, const std::optional<Delays>& d) {
      if (d) json[name] = {{"median", milliseconds(d->median)}, {"p99", milliseconds(d->p99)}};
    };
    add("round_trip_ms", report.round_trip);
    add("to_server_ms", report.to_server);
    add("to_client_ms", report.to_client);
    json["clock_error_ms"] = milliseconds(report.clock_error);
    json["received"] = report.received;
    json["lost"] = report.lost;
    json["reordered"] = report.reordered;
    json["duplicated"] = report.duplicated;
    say_json({{"report", std::move(json)}});
  } else if (!report.words.empty()) {
    std::fprintf(stderr, "%s: the server says: %s\n", options.client.name.c_str(), report.words.c_str());
  }
}

/// Whether an attempt or a session is over, and the next attempt not begun.
bool waits(ForceClient::Phase phase) {
  return phase == ForceClient::Phase::kUnanswered || phase == ForceClient::Phase::kRefused ||
         phase == ForceClient::Phase::kLost;
}

/// The server may have another address by now. Where nobody answered at one, the next one is tried.
void look_up_again(UdpTransport& transport, ForceClient& client, const std::function<void(const std::string&)>& say) {
  try {
    transport.look_up_again(client.phase() == ForceClient::Phase::kUnanswered);
    client.move_to(transport.server());
  } catch (const std::runtime_error& error) {
    say(error.what());
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
    ForceClient client(transport, transport.server(), config, std::move(callback), start);

    std::string said;
    std::string_view unusable;  // the newest reason that was said
    std::string_view left_out;  // likewise
    ForceClient::Phase phase = client.phase();
    PeerTime reported{};
    LocalTime now = start;
    while (now < end && stop_asked == 0) {
      const LocalTime next = std::min(client.turn(now), end);
      const std::string text = sentence(client, transport.server(), options);
      if (!text.empty() && text != said) say(said = text);
      if (const auto why = client.stats().unusable; !why.empty() && why != unusable) {
        say("a force is not sent: " + std::string(unusable = why));
      }
      if (const auto what = client.stats().left_out; !what.empty() && what != left_out) {
        say("not sent with a force: " + std::string(left_out = what));
      }
      if (const auto& report = client.report()) {
        if (std::exchange(reported, report->until) != report->until) print_report(*report, options);
      }
      if (client.phase() == ForceClient::Phase::kRefused && is_final(client.stats().code)) return 1;
      if (client.phase() == ForceClient::Phase::kStopped) return 1;
      if (std::exchange(phase, client.phase()) != client.phase() && waits(client.phase())) {
        look_up_again(transport, client, say);
      }
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
