// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/cpp/force_client.h"

namespace tendon {

/// A body's surface as seen from one point: the answer of a distance query.
struct SurfacePoint {
  double distance = 0;            ///< d, m, signed: < 0 inside the body
  Vec3 normal = Vec3::UnitX();    ///< n = ∇d, out of the body; its length is not used
  Mat3 curvature = Mat3::Zero();  ///< ∇∇d, 1/m: 0 for a plane, (I − n·nᵀ)/(distance to the centre) for a sphere
};

/// The force of a body that pushes back the more the deeper the hand is inside, and never pulls, with its exact
/// stiffness; for engines whose own contact gives no force, and for shapes that are given by a distance alone:
///
///     F = max(0, −k·d − b·v·n)·n  where d < 0, else 0                  N, on the hand
///     K = k·n·nᵀ + k·d·∇∇d        where F is not 0, else 0             N/m, for a hand at rest: without the share
///                                                                      of b
///
/// k N/m and b N·s/m. With b the force begins at b times the speed of the touch, and no sooner.
/// A distance, normal or velocity that is not finite, or a normal of length 0, makes a force that is not finite, which
/// ForceClient counts and does not send. Realtime-safe: yes.
class PenaltyContact {
 public:
  struct Config {
    double stiffness = 500;  ///< k, ≥ 0
    double damping = 0;      ///< b, ≥ 0
  };

  /// Throws std::invalid_argument "FIELD = VALUE: expected …" when a value of `config` is impossible.
  explicit PenaltyContact(const Config& config);

  /// The answer to a hand at that point with this velocity (m/s).
  Touch touch(const SurfacePoint& surface, const Vec3& velocity) const noexcept;

 private:
  Config config_;
};

}  // namespace tendon
