// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "clients/dashboard/bridge_gate.h"
#include "clients/dashboard/feed.h"
#include "clients/dashboard/foxglove_feed.h"
#include "clients/dashboard/metrics.h"
#include "clients/dashboard/routes.h"
#include "protocol/link.h"

namespace tendon::dash {

/// The sockets of tendon-dash and its one thread: HTTP and WebSockets for pages, one UDP socket to the server for the
/// Observer, and one for each page on the bridge. Routes decides what is answered, Feed what pages are told, FoxgloveFeed
/// what viewers are told, and BridgeGate what crosses the bridge. Only the source file behind this header knows Boost.Beast and Boost.Asio.
///
/// * A connection that has not sent a whole request within `request_patience` is closed, and so is one that reads no
///   answer for `patience`. A WebSocket that is silent for `patience` gets a ping. A WebSocket of the bridge gets none,
///   because its page sends something every 50 ms.
/// * There are at most `max_connections`, and at most `max_per_address` from one address (one IPv6 network of 64 bits).
///   When all are in use, a new connection takes the place of the one that has waited longest for a request; when none
///   is waiting, it is answered 503 at once. So connections that send nothing, or send slowly, lock nobody out.
/// * No queue grows without bound: for a page that does not read, PagePost keeps only the newest messages,
///   FoxgloveSession drops the oldest tenths of a second, and BridgeGate drops datagrams.
///
/// Thread-safe: no. Realtime-safe: no.
class WebServer {
 public:
  struct Config {
    Address listen = parse_address("127.0.0.1:8080");     ///< port 0 lets the system choose
    Address server = parse_address("127.0.0.1:47100");    ///< tendond; link() can change it
    std::size_t max_connections = 256;                    ///< of all kinds
    std::size_t max_per_address = 64;                     ///< all pages and bridges of one machine, and their requests
    std::size_t max_pages = 16;                           ///< pages that look on: each costs 150 kB/s of JSON
    std::size_t max_viewers = 8;                          ///< on /foxglove: each costs 200 kB/s for each device
    std::size_t max_bridges = 32;                         ///< as many as a server takes observers
    std::size_t max_request = 16 * 1024;                  ///< bytes of a request's headers
    Duration request_patience = std::chrono::seconds(5);  ///< for a whole request, counted from when it may begin
    Duration patience = std::chrono::seconds(30);         ///< for readers of answers, and for WebSockets
    BridgeGate::Config bridge{};
  };
  using Clock = LocalTime (*)();

  /// Listens from here on. `routes`, the feeds and the counts must outlive the server. Throws std::runtime_error when the
  /// system refuses: "cannot listen on 127.0.0.1:8080: Address already in use".
  WebServer(const Config& config, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
            BridgeCounts& bridge, Clock clock);
  ~WebServer();

  /// The address at which it listens.
  Address address() const;
  /// The link to the server, for the Observer. Datagrams are sent at once.
  Link& link();

  /// Runs until SIGINT or SIGTERM, or until `duration` is over when that is above zero. It calls `turn(now)` when a
  /// datagram has arrived over link(), and at the latest at the time that the last `turn` returned. It calls
  /// `tick(now)` once every Feed::kTick, before the pages get their news.
  void run(Duration duration, const std::function<LocalTime(LocalTime)>& turn,
           const std::function<void(LocalTime)>& tick);

 private:
  struct State;  // keeps Beast out of this header
  std::unique_ptr<State> state_;
};

}  // namespace tendon::dash
