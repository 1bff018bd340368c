// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Determines how the forces of several channels are combined (ForceChannels). Part of the wire format: never renumber.
enum class ChannelRule : std::uint8_t {
  kSum = 1,       ///< the force is added to those of the other channels
  kPriority = 2,  ///< while the force is fresh, later channels with this rule have no effect
};

}  // namespace tendon
