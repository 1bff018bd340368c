// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>

namespace tendon::replay {

/// The options of `tendon-replay --repair`.
struct RepairOptions {
  std::filesystem::path recording;
  std::filesystem::path out;  ///< must not exist yet
  bool json = false;
};

/// Copies all valid messages of a recording to a new file. The content and the time of the messages do not change. A
/// Lost record is added for each gap in the steps or the datagrams of the first device. This also works for the
/// recordings of the flight recorder and of `--merge`.
///
/// Prints the number of messages and the damaged regions to `out`. Throws std::runtime_error if the recording cannot be
/// read or has no valid message, if the new file exists, or if it cannot be written.
void repair(const RepairOptions& options, std::ostream& out);

}  // namespace tendon::replay
