// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "clients/dashboard/rate_limit.h"

namespace tendon::dash {

/// What has passed the bridge, and what has not.
struct BridgeCounts {
  std::uint64_t pages = 0;  ///< WebSockets open now
  std::uint64_t opened = 0;
  std::uint64_t refused_origin = 0;  ///< WebSockets refused: a foreign origin …
  std::uint64_t refused_full = 0;    ///< … or too many
  std::uint64_t to_server = 0;       ///< datagrams
  std::uint64_t to_page = 0;
  std::uint64_t malformed = 0;  ///< not passed on: no datagram of Tendon
  std::uint64_t plain = 0;      ///< … not encrypted, and from another machine
  std::uint64_t too_fast = 0;   ///< … more than max_rate_hz
  std::uint64_t too_slow = 0;   ///< … the page does not keep up, and a newer one follows
};

/// One page's place on the bridge from WebSocket to UDP, without either: one binary message is one datagram, as it is.
///
/// To tendond everything that crosses comes from this machine, whose datagrams in the clear (suite 0) it accepts. So
/// only pages of this machine may send those; from other pages only sealed datagrams pass. The gate has no key and
/// reads only the header, which is in the clear.
///
/// Thread-safe: no. Realtime-safe: no.
class BridgeGate {
 public:
  struct Config {
    double max_rate_hz = 4000;  ///< datagrams a page may send in a second: four engines' at 1 kHz
    /// Waiting for a page: some 60 ms of states at 1 kHz. What is older is of no use to a hand.
    std::size_t max_waiting = 16 * 1024;
  };

  /// `local`: the page is on this machine, and not behind a proxy here. `counts` must outlive the gate.
  BridgeGate(const Config& config, bool local, BridgeCounts& counts, LocalTime now)
      : config_(config), local_(local), counts_(counts), rate_(config.max_rate_hz, now) {}

  /// Whether a message of the page goes to the server. Each counts as exactly one of to_server, malformed, plain,
  /// too_fast.
  bool passes(LocalTime now, std::span<const std::byte> message, bool binary);

  /// Takes a datagram of the server for the page, or drops it where the page does not keep up.
  void offer(std::span<const std::byte> datagram);
  /// The next one to send to the page; empty when none waits.
  std::optional<std::vector<std::byte>> next();

 private:
  Config config_;
  bool local_;
  BridgeCounts& counts_;
  RateLimit rate_;
  std::deque<std::vector<std::byte>> waiting_;
  std::size_t waiting_bytes_ = 0;
};

}  // namespace tendon::dash
