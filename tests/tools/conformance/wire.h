// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"
#include "tests/tools/conformance/datagram.h"

namespace tendon::conformance {

/// The kit's transport and clock: UDP, or a peer in this process with virtual time.
///
/// A port is a local socket of the kit. Toward a server, every port talks to it. Toward a client there is one port,
/// which talks to the sender of the last Hello.
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
  /// Returns the next datagram at `port`, or nullopt at `deadline`.
  virtual std::optional<Arrival> receive(int port, LocalTime deadline) = 0;
  /// The only source of randomness: unpredictable over UDP, reproducible in virtual time.
  virtual std::uint64_t random() = 0;
};

class Guest {
 public:
  virtual ~Guest() = default;
  virtual void start() = 0;
  virtual void ask_to_end() = 0;
  virtual void kill() = 0;
  virtual bool running() = 0;
};

}  // namespace tendon::conformance
