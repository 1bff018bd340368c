// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// The freshness of the rendered remote force (see HeldForce). Part of the wire format and recordings: never renumber.
enum class Mode : std::uint8_t {
  kIdle = 1,      ///< no force has arrived yet
  kActive = 2,    ///< a fresh force is rendered
  kHolding = 3,   ///< the force has expired and is still held
  kDecaying = 4,  ///< the expired force is fading out
  kSafeStop = 5,  ///< the force is zero until a new force is ramped in
  kFault = 6,     ///< no force until the device is explicitly rearmed
};

}  // namespace tendon
