// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "core/base/motion.h"

namespace tendon {

/// Returns false for NaN and infinity. Realtime-safe.
inline bool is_finite(const Effort& effort) noexcept {
  return effort.force.allFinite() && effort.torque.allFinite() && std::isfinite(effort.grip);
}

}  // namespace tendon
