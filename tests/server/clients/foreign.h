// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "protocol/connection.h"
#include "tests/support/wire.h"

namespace tendon {

/// An unencrypted client that can send what ForceClient never sends.
class Foreign {
 public:
  Foreign(Wire& wire, const std::string& address, const Address& server, const Hello& hello, LocalTime now)
      : end(wire, parse_address(address)), connection_(end, server, {.seed = std::uint64_t{end.self.port}}) {
    connection_.greet(now, hello);
  }

  template <class Take>
  void turn(LocalTime now, const Take& take) {
    connection_.begin_turn();
    while (const auto* const event = connection_.next(now)) {
      if (const auto* opened = std::get_if<Connection::Opened>(event)) {
        welcome = opened->welcome;
        if (leaves_at_once) connection_.close(now, "done");
      }
      if (const auto* ended = std::get_if<Connection::Ended>(event)) refused = *ended;
      if (const auto* of_session = std::get_if<const Session::Event*>(event)) take(**of_session);
    }
    connection_.flush(now);
  }
  /// Returns null if there is no session.
  Session* session() { return connection_.session(); }

  End end;
  bool leaves_at_once = false;
  std::optional<Welcome> welcome;
  std::optional<Connection::Ended> refused;

 private:
  Connection connection_;
};

}  // namespace tendon
