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

struct BridgeCounts {
  std::uint64_t pages = 0;  ///< open WebSockets
  std::uint64_t opened = 0;
  std::uint64_t refused_origin = 0;  ///< refused: wrong origin
  std::uint64_t refused_full = 0;    ///< refused: too many WebSockets
  std::uint64_t to_server = 0;       ///< datagrams
  std::uint64_t to_page = 0;
  std::uint64_t malformed = 0;  ///< dropped: not a Tendon datagram
  std::uint64_t plain = 0;      ///< dropped: unencrypted and from another machine
  std::uint64_t too_fast = 0;   ///< dropped: above max_rate_hz
  std::uint64_t too_slow = 0;   ///< dropped: replaced by a newer one because the page is too slow
};

/// Filters the datagrams between one page (WebSocket) and the server (UDP). Each binary message contains one unmodified
/// datagram. For tendond, all datagrams of the bridge come from this machine, and it accepts unencrypted datagrams from
/// this machine (suite 0). Therefore only pages on this machine may send them; other pages must encrypt. The gate has
/// no key and reads only the header, which is never encrypted. Thread-safe: no. Realtime-safe: no.
class BridgeGate {
 public:
  struct Config {
    double max_rate_hz = 4000;            ///< maximum datagrams per second from one page, for four engines at 1 kHz
    std::size_t max_waiting = 16 * 1024;  ///< bytes for a page, about 60 ms of states at 1 kHz; the rest is dropped
  };

  /// `local` is true if the page is on this machine and not behind a local proxy. `counts` must outlive the gate.
  BridgeGate(const Config& config, bool local, BridgeCounts& counts, LocalTime now)
      : config_(config), local_(local), counts_(counts), rate_(config.max_rate_hz, now) {}

  /// Returns whether the page may send this to the server; counts it in to_server, malformed, plain or too_fast.
  bool passes(LocalTime now, std::span<const std::byte> message, bool binary);

  void offer(std::span<const std::byte> datagram);  ///< queues it for the page, or drops it if the page is too slow
  std::optional<std::vector<std::byte>> next();     ///< next datagram for the page, if any

 private:
  Config config_;
  bool local_;
  BridgeCounts& counts_;
  RateLimit rate_;
  std::deque<std::vector<std::byte>> waiting_;
  std::size_t waiting_bytes_ = 0;
};

}  // namespace tendon::dash
