// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

/// A rigid sphere whose contact grows as it is pressed in, without friction (Signorini's conditions). With q the
/// sphere's middle, R its radius and rᵢ the vector across from q to node i, the sphere overlaps the body at rest by
///
///     dᵢ = heightᵢ − q·n + √(R² − |rᵢ|²),   |rᵢ| < R
///
/// The nodes' forces λ have the least energy ½ λᵀGλ − dᵀλ with λ ≥ 0: a node that is pushed lies on the sphere, and all
/// others have no force. They are found by an active set (`pushes.h`), which begins with that of the last answer. The
/// force is the slope of that energy by q, so a closed path gives out no energy:
///
///     force = Σ λᵢ vᵢ,   vᵢ = n − rᵢ/√(R² − |rᵢ|²),      K = V G_AA⁻¹ Vᵀ   (second derivatives of d left out)
///
/// Valid while the contact is many nodes wide: with fewer than eight nodes along its radius the force changes in steps.
///
/// Thread-safe: no. Realtime-safe: no.
class SphereContact {
 public:
  /// Throws std::invalid_argument when the radius is not above 0. Model and surface must outlive this.
  SphereContact(const CondensedModel& body, const TouchSurface& surface, double radius);

  /// There is no force when q is not finite. Throws std::out_of_range when the sphere touches the body outside the
  /// condensed part.
  Feel at(const Vec3& q);

  /// m, across, from q to the farthest node that was pushed in the last answer; 0 when none was.
  double contact_radius() const noexcept { return contact_radius_; }

 private:
  struct Overlap {
    Eigen::Index row;
    double depth;  ///< dᵢ, m
    Vec3 way;      ///< vᵢ
  };
  /// The nodes of the table that are inside the sphere. `gap` becomes the least gap of all touchable nodes.
  std::vector<Overlap> overlaps(const Vec3& q, double& gap) const;

  const CondensedModel& body_;
  const TouchSurface& surface_;
  double radius_;
  std::vector<Vec2> places_;          ///< across, of surface_.nodes()
  std::vector<Eigen::Index> row_of_;  ///< the row of each node in the table; −1: not in it
  std::vector<bool> pushed_;          ///< by row, in the last answer
  double contact_radius_ = 0;
};

}  // namespace tendon::softbody
