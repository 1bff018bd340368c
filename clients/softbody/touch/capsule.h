// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/touch/contact.h"
#include "clients/softbody/touch/pushes.h"

namespace tendon::softbody {

/// A rigid capsule (all points within `radius` of a segment) that presses a linear body without friction. With φ the
/// distance from the capsule's surface and yᵢ = xᵢ + uᵢ the node positions, the body takes the shape of minimum energy
///
///     E = min ½ uᵀKu   with   φ(yᵢ) ≥ 0
///
/// so a pushed node lies on the capsule, and its push λᵢ ≥ 0 acts along the capsule's normal mᵢ = ∇φ(yᵢ). Force and
/// torque are the gradient of this energy with respect to the capsule's pose, so they are conservative, and minus the
/// sums over the nodes:
///
///     force = −Σ λᵢ mᵢ,   torque = −Σ (yᵢ − p) × λᵢ mᵢ   about a point p
///
/// Uses the full compliance, also tangentially. (SphereContact omits the tangential part, a difference of some percent
/// at ν = 0.45 in a deep press.) Solves a sequence of problems of `pushes.h`, in which the capsule is replaced at each
/// node by its tangent plane closest to the node's last position. The capsule is convex, so every iterate is admissible
/// and the energy never increases. Ends when the pushes change direction by less than kEnough of the force; Feel::error
/// gives the rest.
///
/// The stiffnesses are the derivatives of force and torque for a fixed set of pushed nodes: changes of the pushes, of
/// their normals and of their levers. Directions of negative curvature of E, such as a long handle standing on its end,
/// get stiffness 0, so neither matrix has negative eigenvalues.
///
/// Valid while the contact is many nodes wide, as for SphereContact, and for small strains.
///
/// Thread-safe: no. Realtime-safe: no.
class CapsuleContact {
 public:
  /// `nodes` are the touchable nodes, in ascending order. `half_length` is the distance (m) from the center to the
  /// center of an end. Computes the compliance with three solves for each node. Throws std::invalid_argument. `surface`
  /// must outlive this object.
  CapsuleContact(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, double radius,
                 double half_length);

  /// Returns the answer for a capsule at `middle` with the unit vector `axis` (body frame). The torque is about
  /// `about`. There is no force if an argument is not finite. Throws std::out_of_range if the capsule touches the body
  /// outside `nodes`.
  Feel at(const Vec3& middle, const Vec3& axis, const Vec3& about);

  /// Returns the number of problems that the last answer has solved.
  int rounds() const noexcept { return rounds_; }

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
    /// Returns the height (m) of the capsule above x along n. Empty if it is not above or below x.
    std::optional<double> above(const Vec3& x, const Vec3& n) const;
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
  std::vector<bool> pushed_;          ///< by row
  int rounds_ = 0;
};

}  // namespace tendon::softbody
