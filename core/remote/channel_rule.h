// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// How a device combines the forces of its channels: see ForceChannels. Part of the wire: never renumber.
enum class ChannelRule : std::uint8_t {
  kSum = 1,       ///< its force is added to the others
  kPriority = 2,  ///< while its force is fresh, it silences the channels of this rule that come after it
};

}  // namespace tendon
