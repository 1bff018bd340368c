// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>

namespace tendon::replay {

struct MergeOptions {
  std::filesystem::path leader;
  std::filesystem::path follower;
  std::filesystem::path out;  ///< must not exist
  bool json = false;
};

/// Writes an MCAP file with every message of both recordings, under /leader and /follower (/leader/haptic/step).
/// Message bytes do not change; the follower's times are corrected by the clock offset. /merge/clock contains a
/// ClockBound (recording.proto) for each second, computed from the PortStates (clock_bound.h). If there are several
/// devices, the first device must be coupled. If there are several leaders, only the ports of this leader are copied.
///
/// Prints the offset, the bound, the drift and the damaged regions to `out`, and warns if the drift is probably more
/// than kMostDrift. Throws std::runtime_error if a file cannot be read or written, `out` exists, the recordings are not
/// the two ends of one coupling, a clock was stepped, or the drift exceeds kMostDrift.
void merge(const MergeOptions& options, std::ostream& out);

}  // namespace tendon::replay
