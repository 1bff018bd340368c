// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

#include "clients/bridge/bridge_host.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"

namespace tendon::bridge {

/// The current time of both clocks. The second one is used for the time stamps of messages.
struct Moment {
  LocalTime at{};
  Duration since_1970{};
};

/// Runs the main loop of a bridge until a signal is caught or until `end`, and returns the exit code. The server must
/// implement turn(Moment), which returns the time of the next turn, or `at` if a force should be sent immediately. It
/// must also implement polled() for its sockets, and counts() for the JSON lines. `since_1970` is called once per second
/// because the system clock may be adjusted. Thread-safe: no. Realtime-safe: no.
template <class Server>
int run_bridge(BridgeHost& host, Server& server, const StopSignals& signals, LocalTime end, Duration (*since_1970)()) {
  constexpr int kTurnsAtOnce = 4;
  LocalTime now = read_clock();
  LocalTime look_again = now;
  Duration to_1970{};
  while (!signals.asked() && now < end) {
    if (now >= look_again) {
      to_1970 = since_1970() - now.time_since_epoch();
      look_again = now + std::chrono::seconds(1);
    }
    LocalTime next = host.turn(now, server.counts());
    for (int i = 0; i < kTurnsAtOnce && next <= now; ++i) next = host.turn(now = read_clock(), server.counts());
    next = std::min(next, server.turn(Moment{now, now.time_since_epoch() + to_1970}));
    now = read_clock();
    host.wait(server.polled(), now, std::min(next, end));
    now = read_clock();
  }
  return host.stop(now);
}

}  // namespace tendon::bridge
