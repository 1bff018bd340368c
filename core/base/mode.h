// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// How fresh the remote force is that is rendered now (see HeldForce). The values are part of the wire and of
/// recordings: never renumber.
enum class Mode : std::uint8_t {
  kIdle = 1,      ///< no force has come yet
  kActive = 2,    ///< a fresh force is rendered
  kHolding = 3,   ///< the force has outlived its validity and is held a little longer
  kDecaying = 4,  ///< after that it fades
  kSafeStop = 5,  ///< after that it is zero; only a fresh force re-engages, ramped in
  kFault = 6,     ///< latched: zero force until an explicit re-arm
};

}  // namespace tendon
