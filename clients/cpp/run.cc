// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/run.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <deque>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"
#include "clients/cpp/udp_transport.h"
#include "protocol/busy_link.h"
#include "protocol/wire/text.h"
#include "server/machine/output.h"

namespace tendon {
namespace {

using Json = nlohmann::ordered_json;  // preserves the order of the members

/// Upper limit of a sleep, because a signal that arrives immediately before it does not interrupt it.
constexpr Duration kLongestWait = std::chrono::milliseconds(100);

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

void say_json(const Json& json) { std::cout << json << std::endl; }

bool is_final(Code code) { return code != Code::kBusy && code != Code::kShutdown; }

class RunningClient {
 public:
  /// Messages contain the name `device` unless it is empty.
  template <typename Callback>
  RunningClient(const Options& options, const std::string& device, Callback callback, LocalTime start)
      : options_(options),
        device_(device),
        who_(options.client.name + (device.empty() ? "" : " at " + device)),
        transport_(options.server, options.client.key.has_value(), options.dscp),
        client_(options.busy ? static_cast<Link&>(busy_) : transport_, transport_.server(), config(options, device),
                marking(std::move(callback)), start) {
    if (options.field) client_.use(*options.field);
  }
  RunningClient(const RunningClient&) = delete;
  RunningClient& operator=(const RunningClient&) = delete;

  /// Performs the work due at `now` and prints changes. Returns the time of the next turn; empty: stopped permanently.
  std::optional<LocalTime> turn(LocalTime now);
  void answer(LocalTime now, Reply reply) {
    mark(reply.touch);
    client_.answer(now, reply);
  }
  std::uint64_t sessions() const { return client_.stats().sessions; }
  bool open() const { return client_.phase() == ForceClient::Phase::kOpen; }
  void leave(LocalTime now) { client_.stop(now); }
  bool end(LocalTime now, Duration duration);  ///< sends a Bye and prints the summary; false without a session

  UdpTransport& transport() { return transport_; }
  bool look(LocalTime& now) { return busy_.look(now); }

 private:
  Watch marking(Watch watch) { return watch; }
  Physics marking(Physics physics) {
    if (!options_.field) return physics;
    return [this, physics = std::move(physics)](const DeviceState& hand) {
      Touch touch = physics(hand);
      mark(touch);
      return touch;
    };
  }
  void mark(Touch& touch) const {
    if (options_.field) touch.is_truth = client_.field().generation > 0;
  }
  ForceClient::Config config(const Options& options, const std::string& device) const;
  std::string sentence() const;
  std::string about_field() const;
  void say(const std::string& text) const { std::cerr << who_ + ": " + visible(text) + "\n"; }
  void look_up_again();
  Json to_json(const LinkReport& report) const;
  /// Begins a JSON object with the device name if there are several devices.
  Json named() const { return device_.empty() ? Json::object() : Json{{"device", device_}}; }

  const Options& options_;
  std::string device_;
  std::string who_;
  UdpTransport transport_;
  BusyLink busy_{transport_};
  ForceClient client_;

  std::string said_;
  std::string said_of_field_;
  std::string missing_;
  std::string_view unusable_;  // last printed reason
  std::string_view left_out_;  ///< last printed reason for an omitted part of a force
  ForceClient::Phase phase_ = ForceClient::Phase::kGreeting;
  PeerTime reported_{};
};

ForceClient::Config RunningClient::config(const Options& options, const std::string& device) const {
  ForceClient::Config config = options.client;
  if (!device.empty()) config.device = device;
  if (config.device.empty()) config.device = transport_.device();
  config.seed = seed_from_system();
  if (options.field) config.fields = true;
  return config;
}

std::string RunningClient::sentence() const {
  const ForceClient::Stats stats = client_.stats();
  const std::string server = options_.server.at(transport_.server());
  switch (stats.phase) {
    case ForceClient::Phase::kOpen:
      return "connected to " + client_.welcome()->device_name + " at " + server + " (" + client_.welcome()->server +
             ", " + std::to_string(client_.welcome()->loop_hz) + " Hz)";
    case ForceClient::Phase::kUnanswered:
      return "no answer from " + server + "; is tendond running there" +
             (options_.client.key ? ", and does it have this key" : "") + "? Retrying";
    case ForceClient::Phase::kRefused:
      return server + " refused the connection: " + stats.reason + (is_final(stats.code) ? "" : "; retrying");
    case ForceClient::Phase::kLost:
      return "lost " + server + ": " + stats.reason + "; retrying";
    case ForceClient::Phase::kStopped:
      return stats.code == Code::kReplaced ? server + " has ended the session: " + stats.reason : "";
    case ForceClient::Phase::kGreeting:
      return {};
  }
  return {};
}

/// Empty if there is nothing to report.
std::string RunningClient::about_field() const {
  if (!options_.field || !open()) return {};
  const std::vector<std::string>& features = client_.welcome()->features;
  const bool known = std::ranges::find(features, kFeatureFields) != features.end();
  const FieldUpload::Progress& progress = client_.field();
  if (progress.current) return "the server renders the field";
  const std::string refused = known ? progress.refused : "the server does not support fields";
  return refused.empty() ? refused : "the field is not rendered: " + refused;
}

Json RunningClient::to_json(const LinkReport& report) const {
  Json json = named();
  json.update(Json{{"number", report.number},
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
                   {"longest_gap_ms", milliseconds(report.longest_gap)}});
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
  return json;
}

bool waits(ForceClient::Phase phase) {
  return phase == ForceClient::Phase::kUnanswered || phase == ForceClient::Phase::kRefused ||
         phase == ForceClient::Phase::kLost;
}

/// The address of the server may have changed. If the current address did not answer, the next one is tried.
void RunningClient::look_up_again() {
  try {
    transport_.look_up_again(client_.phase() == ForceClient::Phase::kUnanswered);
    client_.move_to(transport_.server());
    missing_.clear();
  } catch (const std::runtime_error& error) {
    if (missing_ != error.what()) say(missing_ = error.what());
  }
}

std::optional<LocalTime> RunningClient::turn(LocalTime now) {
  const LocalTime next = client_.turn(now);
  const std::string text = sentence();
  if (!text.empty() && text != said_) say(said_ = text);
  if (const std::string of_field = about_field(); !of_field.empty() && of_field != said_of_field_) {
    say(said_of_field_ = of_field);
  }
  if (const auto why = client_.stats().unusable; !why.empty() && why != unusable_) {
    say("a force was not sent: " + std::string(unusable_ = why));
  }
  if (const auto what = client_.stats().left_out; !what.empty() && what != left_out_) {
    say("not sent with a force: " + std::string(left_out_ = what));
  }
  if (const auto& report = client_.report(); report && std::exchange(reported_, report->until) != report->until) {
    if (options_.json) {
      say_json({{"report", to_json(*report)}});
    } else if (!report->words.empty()) {
      say("report of the server: " + report->words);
    }
  }
  if (client_.phase() == ForceClient::Phase::kRefused && is_final(client_.stats().code)) return {};
  if (client_.phase() == ForceClient::Phase::kStopped) return {};
  if (std::exchange(phase_, client_.phase()) != client_.phase() && waits(client_.phase())) look_up_again();
  return next;
}

bool RunningClient::end(LocalTime now, Duration duration) {
  leave(now);
  using ull = unsigned long long;
  const ForceClient::Stats stats = client_.stats();
  const LinkStats& link = stats.link;
  if (options_.json) {
    Json summary = named();
    summary.update(Json{{"duration_s", seconds(duration)},
                        {"sessions", stats.sessions},
                        {"states", stats.states},
                        {"states_skipped", stats.states_skipped},
                        {"forces", stats.forces},
                        {"forces_unusable", stats.forces_unusable},
                        {"lost_incoming", link.lost},
                        {"lost_outgoing", link.lost_outgoing},
                        {"round_trip_ms", milliseconds(link.smoothed_round_trip)},
                        {"round_trip_variation_ms", milliseconds(link.round_trip_variation)}});
    say_json({{"summary", std::move(summary)}});
  } else if (stats.sessions == 0) {
    say("was never connected");
  } else {
    std::array<char, 400> text{};
    std::snprintf(text.data(), text.size(),
                  "%.1f s, %llu states received (%llu skipped), %llu forces sent (%llu more unusable), "
                  "datagrams lost: %llu incoming, %llu outgoing, round trip %.2f ± %.2f ms",
                  seconds(duration), ull{stats.states}, ull{stats.states_skipped}, ull{stats.forces},
                  ull{stats.forces_unusable}, ull{link.lost}, ull{link.lost_outgoing},
                  milliseconds(link.smoothed_round_trip), milliseconds(link.round_trip_variation));
    say(text.data());
  }
  return stats.sessions > 0;
}

struct AllHands {
  const Together& engine;
  std::vector<std::optional<DeviceState>> hands;
  bool fresh = false;  ///< the engine has not received one of them
};

struct Beside {
  bool* heard = nullptr;           ///< set by the callback, for Options::on_silence
  Elsewhere* elsewhere = nullptr;  ///< its states are passed by the callback in `seen`
  std::optional<DeviceState>* seen = nullptr;
  AllHands* all_hands = nullptr;  ///< likewise for several hands
};

/// Passes the newest state to the engine and sends its answers. Returns the time of the next turn.
LocalTime turn_elsewhere(const Beside& beside, RunningClient& client, LocalTime now) {
  if (beside.seen->has_value()) {
    beside.elsewhere->see(now, {.hand = **beside.seen, .session = client.sessions()});
    beside.seen->reset();
  }
  bool answered = false;
  while (const auto reply = beside.elsewhere->turn(now)) {
    client.answer(now, *reply);
    answered = true;
  }
  return answered ? now : beside.elsewhere->next_turn();
}

/// Passes all states to the engine if at least one is new, and sends the answers. Returns the time of the next turn.
LocalTime turn_together(AllHands& all, std::deque<RunningClient>& clients, LocalTime now) {
  for (std::size_t i = 0; i < clients.size(); ++i) {
    if (clients[i].open() || !all.hands[i]) continue;
    all.hands[i].reset();
    all.fresh = true;  // the object must respond to the released hand
  }
  if (!std::exchange(all.fresh, false)) return LocalTime::max();
  const std::vector<Touch> touches = all.engine(all.hands);
  for (std::size_t i = 0; i < clients.size(); ++i) {
    if (!all.hands[i]) continue;
    clients[i].answer(now, {.to = {.hand = *all.hands[i], .session = clients[i].sessions()}, .touch = touches.at(i)});
  }
  return now;
}

/// Busy-waits until a client's socket or `also` (−1: none) is readable, or until `end`. Returns the current time.
LocalTime watch(std::deque<RunningClient>& clients, int also, LocalTime now, LocalTime end) {
  while (now < end) {
    for (RunningClient& client : clients) {
      if (client.look(now)) return now;
    }
    if (also >= 0 && UdpTransport::wait_for_any({}, Duration::zero(), also)) return now;
  }
  return now;
}

/// Arguments of a session. An empty `device` selects the one in `options`.
template <typename Callback>
struct Slot {
  const Options* options;
  std::string device;
  Callback callback;
};

template <typename Callback>
int run_with(const Options& options, const std::vector<Slot<Callback>>& slots, const Beside& beside = {}) {
  try {
    const UnblockedOutput output;
    const StopSignals signals;
    const Punctual punctual;
    if (options.busy && has_one_processor()) {
      std::cerr << options.client.name
                << ": busy: this machine has only one processor, so other programs will be blocked\n";
    }
    const LocalTime start = read_clock();
    const LocalTime end = options.duration > Duration::zero() ? start + options.duration : LocalTime::max();
    std::deque<RunningClient> clients;
    std::vector<UdpTransport*> transports;
    for (const auto& [own, device, callback] : slots) {
      transports.push_back(&clients.emplace_back(*own, device, callback, start).transport());
    }
    LocalTime now = start;
    bool* const heard = beside.heard;
    LocalTime quiet = heard != nullptr ? start + options.silence : LocalTime::max();
    while (now < end && !signals.asked()) {
      LocalTime next = end;
      for (RunningClient& client : clients) {
        const std::optional<LocalTime> due = client.turn(now);
        if (!due) {
          for (RunningClient& other : clients) other.leave(now);
          return 1;
        }
        next = std::min(next, *due);
      }
      if (beside.elsewhere != nullptr) next = std::min(next, turn_elsewhere(beside, clients.front(), now));
      if (beside.all_hands != nullptr) {
        try {
          next = std::min(next, turn_together(*beside.all_hands, clients, now));
        } catch (...) {
          for (RunningClient& client : clients) client.leave(now);
          throw;
        }
      }
      if (heard != nullptr) {
        const bool answered = std::exchange(*heard, false);
        if (!answered && now >= quiet) options.on_silence(now);
        if (answered || now >= quiet) quiet = now + options.silence;
        next = std::min(next, quiet);
      }
      now = read_clock();
      if (now >= next) continue;
      const Duration wait = std::min(next - now, kLongestWait);
      const int also = beside.elsewhere != nullptr ? beside.elsewhere->descriptor() : -1;
      if (options.busy) {
        now = watch(clients, also, now, now + wait);
      } else {
        UdpTransport::wait_for_any(transports, wait, also);
        now = read_clock();
      }
    }
    bool all = true;
    for (RunningClient& client : clients) all = client.end(now, now - start) && all;
    return all ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << options.client.name << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace

int run(const Options& options, Physics physics) {
  if (!options.on_silence || !physics) return run_with<Physics>(options, {{&options, "", std::move(physics)}});
  if (options.silence < std::chrono::milliseconds(1)) {
    std::cerr << options.client.name << ": silence: expected at least 1 ms\n";
    return 1;
  }
  bool heard = false;
  const auto hears = [&](const DeviceState& hand) {
    heard = true;
    return physics(hand);
  };
  return run_with<Physics>(options, {{&options, "", hears}}, {.heard = &heard});
}
int run(const Options& options, Watch watch) { return run_with<Watch>(options, {{&options, "", std::move(watch)}}); }

int run(const Options& options, const std::map<std::string, Physics>& physics) {
  if (physics.empty() || physics.contains("") || !options.client.device.empty()) {
    std::cerr << options.client.name << ": this program selects its devices itself: expected no --device\n";
    return 1;
  }
  if (options.on_silence) {
    std::cerr << options.client.name << ": on_silence can only be used with one device\n";
    return 1;
  }
  std::vector<Slot<Physics>> slots;
  for (const auto& [device, callback] : physics) slots.push_back({&options, device, callback});
  return run_with(options, slots);
}

int run(const Options& options, const std::vector<HandAt>& hands, const Together& engine) {
  if (hands.empty() || !options.client.device.empty() || options.on_silence) {
    std::cerr << options.client.name
              << ": expected one or more devices in the program, no --device, and no on_silence\n";
    return 1;
  }
  AllHands all{engine, std::vector<std::optional<DeviceState>>(hands.size())};
  std::deque<Options> own;
  std::vector<Slot<Physics>> slots;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    Options& of_hand = own.emplace_back(options);
    if (hands[i].server) of_hand.server = *hands[i].server;
    slots.push_back({&of_hand, hands[i].device, [&all, i](const DeviceState& hand) {
                       all.hands[i] = hand;
                       all.fresh = true;
                       Touch later;
                       later.unknown = true;
                       return later;
                     }});
  }
  return run_with(options, slots, {.all_hands = &all});
}

int run(const Options& options, Elsewhere& engine) {
  std::optional<DeviceState> seen;
  const auto sees = [&](const DeviceState& hand) {
    seen = hand;
    Touch later;
    later.unknown = true;
    return later;
  };
  return run_with<Physics>(options, {{&options, "", sees}}, {.elsewhere = &engine, .seen = &seen});
}

}  // namespace tendon
