// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>

#include "tests/tools/injector/proxy/prepared_network.h"

namespace tendon::injector {

/// The decisions alone, without sockets and in no time: what a network would do to packets of one size at one rate.
struct DryRun {
  std::uint64_t count = 10'000;  ///< packets in all, up and down by turns
  std::uint64_t rate_hz = 1000;  ///< of each direction, 1…10⁹
  std::uint32_t bytes = 200;     ///< of payload
  bool json = false;
};

/// Writes one line per packet, in the order of sending. As JSON:
///     {"dir":"up","index":0,"t_in_ns":0,"verdict":"pass","cause":"delay","t_out_ns":20123456}
/// t_out_ns is null for a dropped one; of one that is duplicated it is that of the first copy. Everything also goes to
/// `trace`, unless that is null. Times count from the first packet.
void dry_run(const PreparedNetwork& network, const DryRun& options, std::ostream& out, TraceWriter* trace);

}  // namespace tendon::injector
