// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/recording/records.h"

namespace tendon {

/// The values of the previous steps that predict the next one. Use a default object for the first step of a chunk. The
/// haptic thread loads this memory in each step of each device, so it only contains what saves most.
struct StepBefore {
  std::uint64_t tick = 0;
  LocalTime scheduled{};
  Duration spacing{};  ///< difference of the last two scheduled times
  LocalTime at{};
  Vec3 applied = Vec3::Zero();
  Duration longest_hold{};
  std::uint64_t labels = 0;       ///< reasons, force_way and mode
  Mat3 stiffness = Mat3::Zero();  ///< the last one that was not zero
};

/// Returns the maximum size of a packed step.
std::size_t most_packed_bytes(bool handles, bool fields) noexcept;

/// Stores a step without loss, and updates `before`. If the device only measures its position, a step needs about 110
/// bytes instead of 368, and 60 without a force. Returns the end of the packed step.
/// Thread-safe: yes. Realtime-safe: yes.
std::byte* pack_step(const StepRecord& step, StepBefore& before, std::byte* to) noexcept;

/// Reads a packed step and updates `before`, which must be the same as for `pack_step`. Returns the end of the packed
/// step.
const std::byte* unpack_step(const std::byte* from, StepBefore& before, StepRecord& step) noexcept;

}  // namespace tendon
