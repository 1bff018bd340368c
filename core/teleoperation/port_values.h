// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"

namespace tendon {

/// Returns true if the value is within its bounds, and false for NaN. Thread-safe: yes. Realtime-safe: yes.
inline bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }
/// Returns true if the magnitude of each component is at most 10¹² in SI units.
inline bool within(const Vec3& vector) noexcept { return (vector.array().abs() <= 1e12).all(); }

inline Vec3 at_most(const Vec3& force, double most) noexcept {
  const double size = force.stableNorm();
  return size > most ? Vec3(force * (most / size)) : force;
}

}  // namespace tendon
