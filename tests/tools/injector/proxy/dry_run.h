// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <ostream>

#include "tests/tools/injector/proxy/prepared_network.h"

namespace tendon::injector {

struct DryRun {
  std::uint64_t count = 10'000;  ///< the total number of packets in both directions
  std::uint64_t rate_hz = 1000;  ///< in each direction, 1…10⁹
  std::uint32_t bytes = 200;
  bool json = false;
};

/// Writes one line per packet, in the order of sending. As JSON:
///     {"dir":"up","index":0,"t_in_ns":0,"verdict":"pass","cause":"delay","t_out_ns":20123456}
/// t_out_ns is null for a dropped packet, and the time of the first copy for a duplicated one. All times are relative
/// to the first packet. `trace` can be null. With AtEnd::kStop, stops at the end of the replayed trace. Returns
/// TracePlayer::played() for each direction.
std::array<double, 2> dry_run(const PreparedNetwork& network, const DryRun& options, std::ostream& out,
                              TraceWriter* trace);

}  // namespace tendon::injector
