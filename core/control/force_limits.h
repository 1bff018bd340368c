// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/motion.h"
#include "core/base/reason.h"

namespace tendon {

struct Limited {
  Vec3 force;
  Reasons reasons;
};

/// Limits the norm of a force without changing its direction: ‖F‖ ≤ max (N). Thread-safe, realtime-safe.
inline Limited saturate(const Vec3& wanted, double max) noexcept {
  const double size = wanted.norm();
  if (size <= max) return {wanted, {}};
  return {wanted * (max / size), Reason::kMaxForce};
}

/// Limits the rate of change of a force, ‖F − F_before‖ ≤ rate · elapsed, without changing its direction. `rate` is in
/// N/s and can be infinite. If `elapsed` is not positive, this returns `before`. Thread-safe, realtime-safe.
inline Limited limit_slew(const Vec3& wanted, const Vec3& before, double rate, Duration elapsed) noexcept {
  if (std::isinf(rate)) return {wanted, {}};  // the product ∞ · 0 s would be NaN
  const Vec3 change = wanted - before;
  const double size = change.norm();
  const double allowed = rate * std::max(0.0, seconds(elapsed));
  if (size <= allowed) return {wanted, {}};
  return {before + change * (allowed / size), Reason::kSlew};
}

}  // namespace tendon
