// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/recording/records.h"

namespace tendon {

/// The step before a packed one. A new object belongs to the first step of a chunk, which is packed by itself.
struct StepBefore {
  StepRecord step{};
  Duration spacing{};  ///< between the last two scheduled times
  void now(const StepRecord& newer) {
    spacing = newer.scheduled - step.scheduled;
    step = newer;
  }
};

/// The largest number of bytes that `pack_step` writes, for the parts that the steps of a device can have.
std::size_t most_packed_bytes(bool handles, bool fields) noexcept;

/// Writes the values of a step that differ from those of the previous step, or from the values that usually follow from
/// them. All bits are kept. A step of a handle with a position needs about 100 bytes instead of 368, and 30 if the
/// handle is at rest. Up to 7 more bytes are overwritten. Returns the end of the packed step.
/// Thread-safe: yes. Realtime-safe: yes.
std::byte* pack_step(const StepRecord& step, const StepBefore& before, std::byte* to) noexcept;

/// Reads a packed step. `before` must be the same as for `pack_step`. Returns the end of the packed step.
const std::byte* unpack_step(const std::byte* from, const StepBefore& before, StepRecord& step) noexcept;

}  // namespace tendon
