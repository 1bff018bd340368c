// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"
#include "tests/tools/conformance/datagram.h"

namespace tendon::conformance {

/// Where the kit's datagrams go to and come from, and its clock: real UDP, or a peer in this process and virtual time.
///
/// A port is a local socket of the kit. Towards a server each talks to that server; towards a client there is one,
/// which talks to whoever said Hello last.
class Wire {
 public:
  struct Arrival {
    LocalTime at;
    Bytes datagram;
  };

  virtual ~Wire() = default;
  virtual LocalTime now() = 0;
  virtual int open_port() = 0;
  virtual void send(int port, Span datagram) = 0;
  /// The next datagram at `port`; waits until `deadline` for it.
  virtual std::optional<Arrival> receive(int port, LocalTime deadline) = 0;
  /// All that is random: unpredictable over UDP, the same each time in virtual time.
  virtual std::uint64_t random() = 0;
};

/// The client under test, as a program that can be started and asked to end.
class Guest {
 public:
  virtual ~Guest() = default;
  virtual void start() = 0;
  /// Politely: SIGTERM.
  virtual void ask_to_end() = 0;
  /// Not politely.
  virtual void kill() = 0;
  virtual bool running() = 0;
};

}  // namespace tendon::conformance
