// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clients/plug/desk.h"
#include "clients/plug/inverse/inverse_session.h"
#include "protocol/link.h"

namespace tendon::plug {

/// The WebSockets of the bridge and its one thread: each client has an InverseSession, and all share one Desk. It
/// sleeps until a client or a server has sent something, or until the Desk's time has come. Only the source file behind
/// this header knows Boost.Beast and Boost.Asio.
///
/// * **A turn** reads what has come: at most kMostMessages of a client and 256 of all. The forces in them leave before
///   the replies are written, and the replies are of states that have come by then.
/// * **Text or binary**, a message is JSON all the same, because some clients send bytes; replies are text.
/// * **Limits.** `max_clients`; a further one is answered 503. A message above 64 kB ends its client (1009). Of a client
///   with more than `max_unread` bytes of replies no more is read; when it has read nothing for `patience`, it is
///   dropped. Who has not said a whole request within `request_patience` is closed, and at most 16 are waited for.
/// * **Pages.** A request with an Origin comes in as may_come_from() says; another is answered 403. Programs send none.
/// * **Plain HTTP** is answered 404 with a sentence.
///
/// Thread-safe: no. Realtime-safe: no.
class InverseServer {
 public:
  struct Config {
    Address listen = parse_address("127.0.0.1:10001");  ///< port 0 lets the system choose
    std::vector<std::string> origins{};                 ///< of pages that are not of this machine
    std::size_t max_clients = 16;
    std::size_t max_unread = 64 * 1024;  ///< bytes
    Duration patience = std::chrono::seconds(1);
    Duration request_patience = std::chrono::seconds(5);
  };
  static constexpr std::size_t kMostMessages = 64;  ///< of one client in one turn: 64 kB of replies for one device
  using Clock = LocalTime (*)();

  /// Listens from here on. The desk must outlive the server. Throws std::runtime_error when the system refuses:
  /// "cannot listen on 127.0.0.1:10001: Address already in use".
  InverseServer(Config config, Desk& desk, Clock clock);
  ~InverseServer();

  /// The address at which it listens.
  Address address() const;
  const InverseCounts& counts() const noexcept;

  /// Runs until SIGINT or SIGTERM, or until `duration` is over when that is above zero.
  void run(Duration duration);

 private:
  struct State;  // keeps Beast out of this header
  std::unique_ptr<State> state_;
};

}  // namespace tendon::plug
