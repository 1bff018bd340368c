// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

/// A rigid sphere whose contact grows as it is pressed in, without friction (Signorini's conditions). With q the
/// sphere's middle, R its radius and rᵢ the way across from q to node i, the sphere is inside the body at rest by
///
///     dᵢ = heightᵢ − q·n + √(R² − |rᵢ|²),   |rᵢ| < R
///
/// and the nodes' forces λ are those of least energy, ½ λᵀGλ − dᵀλ with λ ≥ 0: where a node is pushed it lies on the
/// sphere, elsewhere it is not pushed. By an active set that begins with the last answer's. The force is the slope of
/// that energy by q, so that nothing is given out on a closed way:
///
///     force = Σ λᵢ vᵢ,   vᵢ = n − rᵢ/√(R² − |rᵢ|²),      K = V G_AA⁻¹ Vᵀ   (second derivatives of d left out)
///
/// Right while the contact is many nodes wide: with fewer than eight to its radius the force goes in steps.
///
/// Thread-safe: no. Realtime-safe: no.
class SphereContact {
 public:
  /// Throws std::invalid_argument when the radius is not above 0. Model and surface must outlive this.
  SphereContact(const CondensedModel& body, const TouchSurface& surface, double radius);

  /// Nothing is felt where q is not finite. Throws std::out_of_range where the sphere is inside the body beyond the
  /// part that was condensed.
  Feel at(const Vec3& q);

  /// m, across, from q to the farthest node that is pushed, in the last answer; 0 when none is.
  double contact_radius() const noexcept { return contact_radius_; }

 private:
  struct Overlap {
    Eigen::Index row;
    double depth;  ///< dᵢ, m
    Vec3 way;      ///< vᵢ
  };
  /// The nodes of the table that are inside the sphere. The least gap, of all touchable nodes, comes back in `gap`.
  std::vector<Overlap> overlaps(const Vec3& q, double& gap) const;

  const CondensedModel& body_;
  const TouchSurface& surface_;
  double radius_;
  std::vector<Vec2> places_;          ///< across, of surface_.nodes()
  std::vector<Eigen::Index> row_of_;  ///< of each of them in the table; −1: not in it
  std::vector<bool> pushed_;          ///< by row, in the last answer
  double contact_radius_ = 0;
};

}  // namespace tendon::softbody
