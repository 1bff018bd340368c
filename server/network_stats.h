// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/estimation/clock_offset_estimator.h"
#include "protocol/handshake.h"
#include "protocol/session.h"
#include "server/clients/served_client.h"

namespace tendon {

/// All counters start at 0 when the server starts.
struct NetworkStats {
  struct Dropped {
    std::uint64_t duplicated = 0;
    std::uint64_t malformed = 0;
    std::uint64_t forged = 0;
    std::uint64_t old_key = 0;
    std::uint64_t invalid = 0;
    std::uint64_t stale = 0;
    RefusedForces forces{};  ///< included in `invalid` and `stale`, except for unknown_tick
  };
  struct Channel {
    std::string device;
    std::string channel;
    std::string holder;
    std::uint64_t forces = 0;                                   ///< passed to the haptic loop
    std::uint64_t handovers = 0;                                ///< from one client to another
    std::uint64_t late = 0;                                     ///< the sum of the four causes below, for this channel
    std::optional<double> worst_error{};                        ///< N, largest error reported by an engine
    std::vector<std::pair<std::string, std::uint64_t>> ways{};  ///< number of forces by solver path
  };

  std::uint64_t welcomed = 0;
  std::uint64_t refused = 0;
  std::uint64_t timed_out = 0;
  std::uint64_t replaced = 0;  ///< by a client with the same key
  std::uint64_t roamed = 0;    ///< a client changed its address
  std::uint64_t half_open_forgotten = 0;
  std::uint64_t refused_stamps = 0;      ///< time stamps of the kernel (KernelStamps)
  std::uint64_t malformed = 0;           ///< the size or the header is invalid
  std::uint64_t unknown_connection = 0;  ///< Data with an unknown connection id or the wrong address
  ServerHandshake::Stats hellos;         ///< Hellos that were not answered with a Welcome or a Refused
  std::uint64_t forces = 0;
  /// Forces and requests without the required channel, and torques and grip forces without the feature `handle`.
  std::uint64_t denied = 0;
  std::uint64_t unanswerable = 0;  ///< forces that answer an unknown or very old tick
  // Forces that arrived after the previous one had expired, by cause (Lateness):
  std::uint64_t late_ours = 0;
  std::uint64_t late_network = 0;
  std::uint64_t late_engine = 0;
  std::uint64_t late_unknown = 0;
  std::uint64_t predicted = 0;  ///< states that were not sent because the client can predict them
  std::uint64_t unusable = 0;   ///< forces that were not used because the link loses too many datagrams
  Dropped dropped;
  std::vector<Channel> channels;
  LinkStats controller;
  std::optional<ClockOffsetEstimator::Estimate> controller_clock;

  NetworkStats& operator+=(const NetworkStats& more);

  /// Adds the drop counters of a session. If the client is a controller, sets `controller` to its link.
  void add(const ServedClient& client);
  void add(const ServedDevice& device, const std::vector<ServedClient>& clients);
};

}  // namespace tendon
