// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/recording/records.h"

namespace tendon {

/// The previous step. Use a default object for the first step of a chunk.
struct StepBefore {
  StepRecord step{};
  Duration spacing{};  ///< difference of the last two scheduled times
  void now(const StepRecord& newer) {
    spacing = newer.scheduled - step.scheduled;
    step = newer;
  }
};

/// Returns the maximum size of a packed step.
std::size_t most_packed_bytes(bool handles, bool fields) noexcept;

/// Stores the differences to the values that are predicted from the previous step, without loss. If the device only
/// measures its position, a step needs about 100 bytes instead of 368, and 40 at rest. This can also overwrite the next
/// 7 bytes. Returns the end of the packed step.
/// Thread-safe: yes. Realtime-safe: yes.
std::byte* pack_step(const StepRecord& step, const StepBefore& before, std::byte* to) noexcept;

/// Reads a packed step. `before` must be the same as for `pack_step`. Returns the end of the packed step.
const std::byte* unpack_step(const std::byte* from, const StepBefore& before, StepRecord& step) noexcept;

}  // namespace tendon
