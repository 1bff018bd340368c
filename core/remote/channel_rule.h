// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// How a device combines the forces of its channels (ForceChannels). Part of the wire format: never renumber.
enum class ChannelRule : std::uint8_t {
  kSum = 1,       ///< its force is added
  kPriority = 2,  ///< while its force is fresh, later channels of this rule are silent
};

}  // namespace tendon
