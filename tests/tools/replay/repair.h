// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <ostream>

namespace tendon::replay {

struct RepairOptions {
  std::filesystem::path recording;
  std::filesystem::path out;  ///< must not exist yet
  bool json = false;
};

/// Copies all valid messages to a new file and adds a Lost record for each gap in the steps or datagrams of the first
/// device. For recordings of the flight recorder and of `--merge`. Prints the number of messages and the damaged
/// regions to `out`. Throws std::runtime_error if the recording cannot be read or has no valid message, or if the new
/// file exists or cannot be written.
void repair(const RepairOptions& options, std::ostream& out);

}  // namespace tendon::replay
