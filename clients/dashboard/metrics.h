// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "clients/dashboard/board.h"
#include "clients/dashboard/bridge_gate.h"

namespace tendon::dash {

/// The counts of tendon-dash itself.
struct WebCounts {
  std::uint64_t pages = 0;  ///< open now
  std::uint64_t requests = 0;
  std::uint64_t refused = 0;         ///< requests: another Host or Origin, too many, malformed
  std::uint64_t states_skipped = 0;  ///< not told to a page that did not keep up
};

/// All these values for Prometheus, in its text format 0.0.4. Names follow its conventions: base units (seconds,
/// meters, newtons, joules), `_total` on counters. Unknown values are not exported. The test that reads
/// deploy/monitoring lists the names.
///
/// Thread-safe: no. Realtime-safe: no.
std::string metrics_text(const Board& board, const WebCounts& web, const BridgeCounts& bridge);

}  // namespace tendon::dash
