// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>

namespace tendon::replay {

/// Options of `tendon-replay --merge`, which merges the recordings of both ends of a coupling on the leader's clock.
struct MergeOptions {
  std::filesystem::path leader;
  std::filesystem::path follower;
  std::filesystem::path out;  ///< must not exist
  bool json = false;
};

/// Writes an MCAP file with every message of both recordings. The leader's channels move to /leader and the follower's
/// to /follower (for example /leader/haptic/step). Message bytes do not change; the follower's times are corrected by
/// the clock offset. /merge/clock contains a ClockBound (recording.proto) for each second, computed from the PortStates
/// in both recordings (clock_bound.h). If a server has several devices, the first must be the coupled one. If a
/// follower has several leaders, only the ports of this leader are copied.
///
/// Prints the offset, the bound, the drift and the damaged regions to `out`, and warns if the drift is probably more
/// than kMostDrift. Throws std::runtime_error if a file cannot be read or written, `out` exists, the recordings are not
/// the two ends of one coupling, a clock was stepped, or the drift exceeds kMostDrift.
void merge(const MergeOptions& options, std::ostream& out);

}  // namespace tendon::replay
