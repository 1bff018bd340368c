// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/touch/contact.h"
#include "clients/softbody/touch/pushes.h"

namespace tendon::softbody {

/// A rigid capsule that presses a linear body without friction. φ is the distance from the surface of the capsule, and
/// yᵢ = xᵢ + uᵢ are the positions of the nodes. The body minimizes the energy
///
///     E = min ½ uᵀKu   with   φ(yᵢ) ≥ 0
///
/// A pushed node is on the capsule, and its force λᵢ ≥ 0 is along the normal mᵢ = ∇φ(yᵢ). The force and the torque are
/// derivatives of the energy, so a closed path gives no energy:
///
///     force = −Σ λᵢ mᵢ,   torque = −Σ (yᵢ − p) × λᵢ mᵢ   about a point p
///
/// The tangential compliance is included; SphereContact omits it, which is some percent for a deep press with ν = 0.45.
/// Each iteration replaces the capsule by a tangent plane at each node, and solves a problem of `pushes.h`. The capsule
/// is convex, so the energy never increases. The search ends if the directions of the forces change by less than
/// kEnough; Feel::error contains the rest.
///
/// The stiffnesses are derivatives for a constant set of pushed nodes. They include the changes of the forces, the
/// normals and the levers. They are 0 if E has a negative curvature, as for a long handle that stands on its end. The
/// contact must be many nodes wide, and the strains must be small.
///
/// Thread-safe: no. Realtime-safe: no.
class CapsuleContact {
 public:
  /// `nodes` are the touchable nodes, ascending; `half_length` (m) is from the center to the center of an end. Computes
  /// the compliance with three solves for each node. `surface` must outlive this object. Throws std::invalid_argument.
  CapsuleContact(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, double radius,
                 double half_length);

  /// Answers a capsule at `middle` with the unit vector `axis` (body frame); the torque is about `about`. No force if
  /// an argument is not finite. Throws std::out_of_range if the capsule touches the body outside `nodes`.
  Feel at(const Vec3& middle, const Vec3& axis, const Vec3& about);

  int rounds() const noexcept { return rounds_; }  ///< number of problems that the last answer has solved

  std::size_t bytes() const noexcept;

  static constexpr double kEnough = 1e-6;

 private:
  struct Plane {
    Vec3 point;   ///< m
    Vec3 normal;  ///< unit vector, outward
  };
  struct Capsule {
    Vec3 middle;
    Vec3 axis;
    double radius;
    double half_length;
    Vec3 nearest_of_axis(const Vec3& y) const;
    Plane nearest(const Vec3& y, const Vec3& otherwise) const;
    std::optional<double> above(const Vec3& x, const Vec3& n) const;  ///< m, of the capsule above x along n, if any
  };
  struct Node {
    Eigen::Index row;
    Vec3 at_rest;
    Vec3 at;
    Plane plane;
  };
  std::vector<Node> near(const Capsule& tool, double& gap) const;
  void add_slopes(const Capsule& tool, const Vec3& about, const std::vector<Node>& nodes, const Pushes& pushes,
                  Feel& feel) const;
  void give_way(std::vector<Node>& nodes, const std::vector<Eigen::Index>& set, const VectorXd& push) const;

  const TouchSurface& surface_;
  double radius_;
  double half_length_;
  std::vector<Vec3> places_;          ///< m, at rest
  std::vector<Eigen::Index> row_of_;  ///< row of each node in compliance_, or −1
  MatrixXd compliance_;               ///< m/N
  std::vector<bool> pushed_;
  int rounds_ = 0;
};

}  // namespace tendon::softbody
