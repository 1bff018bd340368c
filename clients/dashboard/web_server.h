// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "clients/dashboard/bridge_gate.h"
#include "clients/dashboard/feed.h"
#include "clients/dashboard/foxglove_feed.h"
#include "clients/dashboard/metrics.h"
#include "clients/dashboard/routes.h"
#include "protocol/link.h"

namespace tendon::dash {

/// All sockets of tendon-dash on one thread: HTTP and WebSockets for pages, one UDP socket for the Observer, and one
/// for each page on the bridge. The content comes from Routes, Feed, FoxgloveFeed and BridgeGate.
///
/// * Connections without a complete request after `request_patience`, or that do not read a reply for `patience`, are
///   closed. WebSockets that are silent for `patience` get a ping, except on the bridge, where pages send every 50 ms.
/// * There are at most `max_connections`, and `max_per_address` from one address (or IPv6 /64 network). If all are in
///   use, a new connection replaces the one that has waited longest for a request, or receives 503 if none is waiting.
///   Clients that send nothing or slowly therefore cannot block others.
/// * All queues are bounded: for a page that does not read, PagePost keeps only the newest messages, FoxgloveSession
///   drops the oldest tenths of a second, and BridgeGate drops datagrams.
///
/// Thread-safe: no. Realtime-safe: no.
class WebServer {
 public:
  struct Config {
    Address listen = parse_address("127.0.0.1:8080");   ///< port 0: chosen by the system
    Address server = parse_address("127.0.0.1:47100");  ///< initial address of tendond; link() can change it
    std::size_t max_connections = 256;                  ///< in total
    std::size_t max_per_address = 64;                   ///< pages, bridges and requests of one machine
    std::size_t max_pages = 16;                         ///< pages on /live; each page needs 150 kB/s of JSON
    std::size_t max_viewers = 8;                        ///< clients of /foxglove; each client needs 200 kB/s per device
    std::size_t max_bridges = 32;                       ///< the limit of observers of a server
    std::uint32_t max_request = 16 * 1024;              ///< bytes of request headers
    Duration request_patience = std::chrono::seconds(5);  ///< timeout of a request
    Duration patience = std::chrono::seconds(30);         ///< timeout for reading replies, and for WebSockets
    BridgeGate::Config bridge{};
  };
  using Clock = LocalTime (*)();

  /// Starts to listen. `routes`, the feeds and the counts must outlive the server. Throws std::runtime_error: "cannot
  /// listen on 127.0.0.1:8080: Address already in use".
  WebServer(const Config& config, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
            BridgeCounts& bridge, Clock clock);
  ~WebServer();

  Address address() const;
  Link& link();  ///< to the server, for the Observer; sends datagrams immediately

  /// Runs until SIGINT or SIGTERM, or for `duration` if it is > 0. Calls `turn(now)` when a datagram has arrived over
  /// link(), at the latest at the time that the last `turn` returned. Calls `tick(now)` every Feed::kTick, before the
  /// pages are updated.
  void run(Duration duration, const std::function<LocalTime(LocalTime)>& turn,
           const std::function<void(LocalTime)>& tick);

 private:
  struct State;  // hides Beast
  std::unique_ptr<State> state_;
};

}  // namespace tendon::dash
