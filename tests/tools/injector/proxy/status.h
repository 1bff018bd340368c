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

struct Status {
  Duration elapsed{};                           ///< since the proxy began to listen
  std::array<ProxyMeasurements, 2> directions;  ///< by Direction
  std::vector<Proxy::ClientSummary> clients;
  std::size_t in_flight = 0;

  /// The latency of the system's timer. It is measured by the thread of the driver, which sleeps for the same time as
  /// before its last release. The remaining part of the release error is caused by the proxy.
  DurationHistogram timer_floor;

  std::uint64_t overflowed = 0;  ///< dropped by the kernel because the receive buffer was full
  std::uint64_t unrecorded = 0;  ///< number of decisions that were lost because the disk was too slow
  std::size_t scenario_steps = 0;
  std::size_t scenario_done = 0;
  std::string last_change;  ///< the last change of the network
  Address server{};
  std::string no_socket;           ///< the first error of opening a socket for a client, or empty
  std::uint64_t late_rebinds = 0;  ///< datagrams sent from the old port because the new one could not be opened

  /// The error of the quantiles is at most 3 %.
  const ProxyMeasurements& of(Direction direction) const { return directions[static_cast<std::size_t>(direction)]; }
};

/// Datagrams were sent to the server, but nothing was received.
bool is_unanswered(const Status& status) noexcept;

/// At a haptic period of 1 ms, such a datagram arrives one step late, so the run is not the requested network.
inline constexpr Duration kMaxReleaseError = std::chrono::milliseconds(1);

/// Sentences for the user; none for a valid run. `max_release_error` limits the 99th percentile in either direction.
std::vector<std::string> why_invalid(const Status& status, Duration max_release_error);

/// Of a trace, for example "3.5".
std::string played_text(double times);

/// Totals since the start, whether valid or not:
/// {"t_s":12.0,"clients":1,"in_flight":40,"valid":true,"invalid_because":[],"timer_floor_us":{…},"up":{…},"down":{…}}
JsonLine in_json(const Status& status, Duration max_release_error);

}  // namespace tendon::injector
