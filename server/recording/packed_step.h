// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/recording/records.h"

namespace tendon {

/// The prediction of the next step. Use a default object for the first step of a chunk. Keep this small: the haptic
/// thread loads it for each device in each step.
struct StepBefore {
  std::uint64_t tick = 0;
  LocalTime scheduled{};
  Duration spacing{};  ///< difference of the last two scheduled times
  LocalTime at{};
  Vec3 applied = Vec3::Zero();
  Duration longest_hold{};
  std::uint64_t labels = 0;       ///< reasons, force_way and mode
  Mat3 stiffness = Mat3::Zero();  ///< the last nonzero matrix
};

/// Returns the maximum size of a packed step.
std::size_t most_packed_bytes(bool handles, bool fields) noexcept;

/// Stores a step without loss, and updates `before`. A step of a position needs about 110 bytes, or 60 without a force.
/// `to` must have `most_packed_bytes`. Returns the end of the packed step.
/// Thread-safe: yes. Realtime-safe: yes.
std::byte* pack_step(const StepRecord& step, StepBefore& before, std::byte* to) noexcept;

/// Reads a packed step and updates `before`, which must be the same as for `pack_step`. Returns the end of the packed
/// step.
const std::byte* unpack_step(const std::byte* from, StepBefore& before, StepRecord& step) noexcept;

}  // namespace tendon
