// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/cpp/force_client.h"

namespace tendon {

/// Result of a distance query between a point and the surface of a body.
struct SurfacePoint {
  double distance = 0;            ///< d, m, signed: negative inside the body
  Vec3 normal = Vec3::UnitX();    ///< n = ∇d, pointing out of the body; need not be normalized
  Mat3 curvature = Mat3::Zero();  ///< ∇∇d, 1/m: 0 for a plane, (I − n·nᵀ)/(distance to the center) for a sphere
};

/// Penalty contact with its exact stiffness, for engines that only detect contact, and signed distances. Never pulls:
///
///     F = max(0, −k·d − b·v·n)·n  if d < 0, else 0                 N, acting on the hand
///     K = k·n·nᵀ + k·d·∇∇d        if F ≠ 0, else 0                 N/m, without the contribution of b
///
/// with k in N/m and b in N·s/m. With b > 0, the force jumps at contact to b times the approach speed. An input that is
/// not finite, or a zero normal, gives a force that is not finite, which ForceClient does not send. Realtime-safe: yes.
class PenaltyContact {
 public:
  struct Config {
    double stiffness = 500;  ///< k, ≥ 0
    double damping = 0;      ///< b, ≥ 0
  };

  explicit PenaltyContact(const Config& config);  ///< throws std::invalid_argument "FIELD = VALUE: expected …"

  Touch touch(const SurfacePoint& surface, const Vec3& velocity) const noexcept;  ///< `velocity` of the hand in m/s

 private:
  Config config_;
};

}  // namespace tendon
