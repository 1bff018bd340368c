// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

/// A rigid sphere without friction (Signorini's conditions). q is the center, R is the radius, and rᵢ is the tangential
/// vector from q to node i. The overlap with the body at rest is
///
///     dᵢ = heightᵢ − q·n + √(R² − |rᵢ|²),   |rᵢ| < R
///
/// The forces λ ≥ 0 minimize ½ λᵀGλ − dᵀλ, so that a pushed node is on the sphere. The active set starts with that of
/// the last answer (`pushes.h`). The force is the derivative of this energy, so a closed path gives no energy:
///
///     force = Σ λᵢ vᵢ,   vᵢ = n − rᵢ/√(R² − |rᵢ|²),      K = V G_AA⁻¹ Vᵀ   (second derivatives of d left out)
///
/// With fewer than eight nodes along the radius of the contact, the force changes in steps.
///
/// Thread-safe: no. Realtime-safe: no.
class SphereContact {
 public:
  /// `body` and `surface` must outlive this object. Throws std::invalid_argument if the radius is not positive.
  SphereContact(const CondensedModel& body, const TouchSurface& surface, double radius);

  Feel at(const Vec3& q);  ///< no force if q is not finite; throws std::out_of_range if it touches outside of the table

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
  std::vector<Vec2> places_;
  std::vector<Eigen::Index> row_of_;  ///< row of each node, or −1
  std::vector<bool> pushed_;
  double contact_radius_ = 0;
};

}  // namespace tendon::softbody
