// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

/// A rigid sphere with a growing frictionless contact (Signorini's conditions). With q the center, R the radius and rᵢ
/// the tangential vector from q to node i, the sphere overlaps the body at rest by
///
///     dᵢ = heightᵢ − q·n + √(R² − |rᵢ|²),   |rᵢ| < R
///
/// The nodal forces λ minimize ½ λᵀGλ − dᵀλ with λ ≥ 0: a pushed node lies on the sphere, all others are unloaded. An
/// active-set method (`pushes.h`) starts from the last answer's set. The force is the gradient of that energy with
/// respect to q, so it is conservative:
///
///     force = Σ λᵢ vᵢ,   vᵢ = n − rᵢ/√(R² − |rᵢ|²),      K = V G_AA⁻¹ Vᵀ   (second derivatives of d left out)
///
/// Valid while the contact is many nodes wide: with fewer than eight nodes along its radius the force changes in steps.
///
/// Thread-safe: no. Realtime-safe: no.
class SphereContact {
 public:
  /// `body` and `surface` must outlive this object. Throws std::invalid_argument if the radius is not positive.
  SphereContact(const CondensedModel& body, const TouchSurface& surface, double radius);

  /// There is no force if q is not finite. Throws std::out_of_range if the sphere touches the body outside the table.
  Feel at(const Vec3& q);

  /// The tangential distance (m) from q to the farthest node that was pushed, or 0.
  double contact_radius() const noexcept { return contact_radius_; }

 private:
  struct Overlap {
    Eigen::Index row;
    double depth;  ///< dᵢ, m
    Vec3 way;      ///< vᵢ
  };
  /// Returns the nodes inside the sphere. `gap` is the minimum over all touchable nodes.
  std::vector<Overlap> overlaps(const Vec3& q, double& gap) const;

  const CondensedModel& body_;
  const TouchSurface& surface_;
  double radius_;
  std::vector<Vec2> places_;          ///< tangential
  std::vector<Eigen::Index> row_of_;  ///< row of each node, or −1
  std::vector<bool> pushed_;          ///< by row
  double contact_radius_ = 0;
};

}  // namespace tendon::softbody
