// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "clients/dashboard/board.h"
#include "clients/dashboard/bridge_gate.h"

namespace tendon::dash {

struct WebCounts {
  std::uint64_t pages = 0;  ///< currently open
  std::uint64_t requests = 0;
  std::uint64_t refused = 0;         ///< requests refused because of Host, Origin, load or syntax
  std::uint64_t states_skipped = 0;  ///< states that were not sent because the page was too slow
};

/// Returns all metrics in the Prometheus text format 0.0.4. Names have base units (seconds, meters, newtons, joules),
/// and `_total` for counters. Unknown values are omitted. A test compares the names with deploy/monitoring.
/// Thread-safe: no. Realtime-safe: no.
std::string metrics_text(const Board& board, const WebCounts& web, const BridgeCounts& bridge);

}  // namespace tendon::dash
