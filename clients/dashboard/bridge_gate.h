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

/// Counts of the bridge: passed on, and refused.
struct BridgeCounts {
  std::uint64_t pages = 0;  ///< WebSockets open now
  std::uint64_t opened = 0;
  std::uint64_t refused_origin = 0;  ///< WebSockets refused because of a foreign origin
  std::uint64_t refused_full = 0;    ///< WebSockets refused because there were too many
  std::uint64_t to_server = 0;       ///< datagrams
  std::uint64_t to_page = 0;
  std::uint64_t malformed = 0;  ///< not passed on: not a datagram of Tendon
  std::uint64_t plain = 0;      ///< not passed on: not encrypted, and from another machine
  std::uint64_t too_fast = 0;   ///< not passed on: more than max_rate_hz
  std::uint64_t too_slow = 0;   ///< not passed on: the page does not keep up, and a newer one follows
};

/// One page's place on the bridge between WebSocket and UDP; it has no socket itself. One binary message is one
/// datagram, unchanged.
///
/// To tendond every datagram from the bridge comes from this machine, and it accepts such datagrams in the clear (suite
/// 0). So only pages on this machine may send those; other pages may send sealed datagrams only. The gate has no key
/// and reads only the header, which is never encrypted.
///
/// Thread-safe: no. Realtime-safe: no.
class BridgeGate {
 public:
  struct Config {
    double max_rate_hz = 4000;  ///< datagrams that a page may send in a second: those of four engines at 1 kHz
    /// Bytes of the datagrams that wait for a page: some 60 ms of states at 1 kHz. One that does not fit is dropped.
    std::size_t max_waiting = 16 * 1024;
  };

  /// `local`: the page is on this machine, and not behind a proxy here. `counts` must outlive the gate.
  BridgeGate(const Config& config, bool local, BridgeCounts& counts, LocalTime now)
      : config_(config), local_(local), counts_(counts), rate_(config.max_rate_hz, now) {}

  /// True when a message from the page may go to the server. Each message counts as exactly one of to_server,
  /// malformed, plain, too_fast.
  bool passes(LocalTime now, std::span<const std::byte> message, bool binary);

  /// Takes a datagram from the server for the page. Drops this datagram when the page does not keep up.
  void offer(std::span<const std::byte> datagram);
  /// The next datagram to send to the page; empty when none waits.
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
