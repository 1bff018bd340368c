// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"

namespace tendon {

/// Whether what a port tells is in its bounds, which NaN is in none of. Thread-safe: yes. Realtime-safe: yes.
inline bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }
/// Each component, in m, m/s, N and so on: at most 10¹².
inline bool within(const Vec3& vector) noexcept { return (vector.array().abs() <= 1e12).all(); }

/// Returns the force with its norm limited to `most`.
inline Vec3 at_most(const Vec3& force, double most) noexcept {
  const double size = force.stableNorm();
  return size > most ? Vec3(force * (most / size)) : force;
}

}  // namespace tendon
