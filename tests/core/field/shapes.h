// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/motion.h"

/// True signed distances (m) of the shapes in the tests of fields.
namespace tendon::field {

inline double sphere(const Vec3& x) { return x.norm() - 0.03; }

inline double torus(const Vec3& x) {
  const double ring = std::sqrt(x.x() * x.x() + x.y() * x.y()) - 0.025;
  return std::sqrt(ring * ring + x.z() * x.z()) - 0.012;
}

/// A hollow sphere with a wall of 8 mm.
inline double shell(const Vec3& x) { return std::abs(x.norm() - 0.03) - 0.004; }

inline double box(const Vec3& x, const Vec3& half) {
  const Vec3 q = x.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

inline double sharp_box(const Vec3& x) { return box(x, {0.02, 0.025, 0.01}); }

}  // namespace tendon::field
