// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/support/json_line.h"
#include "tests/tools/injector/proxy/duration_histogram.h"
#include "tests/tools/injector/proxy/proxy.h"

namespace tendon::injector {

/// All that a run of the proxy has to say about itself, at one moment.
struct Status {
  Duration elapsed{};                           ///< since the proxy began to listen
  std::array<ProxyMeasurements, 2> directions;  ///< by Direction
  std::vector<Proxy::ClientSummary> clients;
  std::size_t in_flight = 0;

  /// How late the machine's own timer was: the same thread, asleep in the same system call for as long as before its
  /// last release, woken with nothing to send. The proxy has added the rest of a release error.
  DurationHistogram timer_floor;

  std::uint64_t overflowed = 0;    ///< datagrams that the kernel threw away before the proxy had read them
  std::uint64_t unrecorded = 0;    ///< decisions that the disk was too slow for
  std::size_t scenario_steps = 0;  ///< of the timeline
  std::size_t scenario_done = 0;   ///< … that are behind us
  std::string last_change;         ///< of the network, by the timeline or by a command
  Address server{};                ///< in use
  std::string no_socket;           ///< the first error when a socket for a client was opened, or empty
  std::uint64_t late_rebinds = 0;  ///< datagrams sent from the old port, because the new one could not be opened

  /// Of one direction. Because of the quantiles, up to 3 % too high.
  const ProxyMeasurements& of(Direction direction) const { return directions[static_cast<std::size_t>(direction)]; }
};

/// Returns true if datagrams were sent to the server, but nothing was received.
bool is_unanswered(const Status& status) noexcept;

/// At a haptic period of 1 ms, a datagram that leaves this late slips into the next step of whoever waits for it: then
/// the run was not one of the network that was asked for.
inline constexpr Duration kMaxReleaseError = std::chrono::milliseconds(1);

/// Why the network was not the one that was asked for, in sentences; empty when it was. `max_release_error`: what one
/// datagram in a hundred may exceed, in either direction.
std::vector<std::string> why_invalid(const Status& status, Duration max_release_error);

/// Totals since the start, valid or not:
///     {"t_s":12.0,"clients":1,"in_flight":40,"valid":true,"invalid_because":[],"timer_floor_us":{…},"up":{…},"down":{…}}
JsonLine in_json(const Status& status, Duration max_release_error);

}  // namespace tendon::injector
