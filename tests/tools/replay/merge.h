// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>

namespace tendon::replay {

/// `tendon-replay --merge`: the recordings of both ends of a coupling as one, in the leader's time.
struct MergeOptions {
  std::filesystem::path leader;
  std::filesystem::path follower;
  std::filesystem::path out;  ///< must not exist
  bool json = false;
};

/// Writes an MCAP file with every message of both, the leader's channels under /leader and the follower's under
/// /follower (/leader/haptic/step), their bytes as they were recorded and the follower's times moved by the offset of
/// the clocks; and /merge/clock, a ClockBound (recording.proto) each second. The bound comes from the PortStates that
/// both recorded (clock_bound.h). Of a server with several devices its first device is the coupled one. Of a follower
/// with several leaders the ports of this one are taken, and those of the others left out.
///
/// Prints the offset, the bound, the drift and the damaged regions to `out`, and warns if the drift is probably more than
/// kMostDrift. Throws std::runtime_error when a file cannot be read
/// or written, when `out` exists, when the two are not the two ends of one coupling, when one of the clocks stepped, or when they drift by
/// more than kMostDrift.
void merge(const MergeOptions& options, std::ostream& out);

}  // namespace tendon::replay
