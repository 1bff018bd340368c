// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

#include "clients/bridge/bridge_host.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"

namespace tendon::bridge {

/// One instant in both clocks: for intervals and for message time stamps.
struct Moment {
  LocalTime at{};
  Duration since_1970{};
};

/// The main loop of a bridge with sockets of its own, until a signal is caught or until `end`. `server` serves its
/// programs in turn(Moment), which returns the time of the next turn, or `at` if a requested force should be sent
/// immediately; polled() are its sockets, and counts() are for the JSON lines. `since_1970` reads the system clock, at
/// most once per second, because it may be adjusted. Returns the exit code. Thread-safe: no. Realtime-safe: no.
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
