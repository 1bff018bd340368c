// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clients/bridge/bridge_host.h"
#include "clients/bridge/inverse/inverse_session.h"
#include "protocol/link.h"

namespace tendon::bridge {

/// The WebSocket server of the bridge. It uses one thread. Each client has an InverseSession; all share one BridgeHost.
///
/// * **Turns.** In each turn, at most kMostMessages of each client are read, and 256 in total. Their forces are sent
///   before the replies are written, and the replies contain the newest states.
/// * **Messages** may be text or binary, because some clients send JSON as bytes. Replies are text.
/// * **Limits.** Clients beyond `max_clients` receive status 503. The connection is closed (1009) if a message is
///   larger than 64 kB. A client with more than `max_unread` bytes of unread replies is not read, and is closed if it
///   reads nothing for `patience`. Connections without a complete request after `request_patience` are closed; at most
///   16 may be waiting.
/// * **Browsers.** Requests with an Origin must pass may_come_from() or receive status 403. Other programs send none.
/// * **Plain HTTP** requests receive status 404 with an explanation.
///
/// Thread-safe: no. Realtime-safe: no.
class InverseServer {
 public:
  struct Config {
    Address listen = parse_address("127.0.0.1:10001");  ///< port 0: chosen by the system
    std::vector<std::string> origins{};                 ///< allowed origins of pages from other machines
    std::size_t max_clients = 16;
    std::size_t max_unread = 64 * 1024;  ///< bytes
    Duration patience = std::chrono::seconds(1);
    Duration request_patience = std::chrono::seconds(5);
  };
  static constexpr std::size_t kMostMessages = 64;  ///< maximum for one client in one turn; this is 64 kB of replies
  using Clock = LocalTime (*)();

  /// Starts to listen. The BridgeHost must outlive the server. Throws std::runtime_error: "cannot listen on
  /// 127.0.0.1:10001: Address already in use".
  InverseServer(Config config, BridgeHost& host, Clock clock);
  ~InverseServer();

  Address address() const;
  const InverseCounts& counts() const noexcept;

  void run(Duration duration);  ///< runs until SIGINT or SIGTERM, or for `duration` if it is > 0

 private:
  struct State;  // hides Beast
  std::unique_ptr<State> state_;
};

}  // namespace tendon::bridge
