// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/touch/contact.h"
#include "clients/softbody/touch/pushes.h"

namespace tendon::softbody {

/// A rigid capsule (all points within `radius` of a line from end to end) that presses a linear body without friction.
/// With φ the distance of a point from the capsule's surface and yᵢ = xᵢ + uᵢ the places of the nodes, the body takes
/// the shape of least energy
///
///     E = min ½ uᵀKu   with   φ(yᵢ) ≥ 0
///
/// so a pushed node lies on the capsule, and its push λᵢ ≥ 0 is along the capsule's normal mᵢ = ∇φ(yᵢ) there. The force
/// and the torque are the slope of that energy as the capsule moves and turns, so no closed path gives out energy; and
/// they are the sums of what the nodes feel, with the opposite sign:
///
///     force = −Σ λᵢ mᵢ,   torque = −Σ (yᵢ − p) × λᵢ mᵢ   about a point p
///
/// The body answers with its whole compliance, along the surface too. (SphereContact leaves that out: with ν = 0.45 it
/// differs by some percent in a deep press.) The search solves one problem of `pushes.h` after another, in which a
/// plane stands for the capsule at each node: the plane that touches it where it is nearest to the node's last place. A
/// capsule is convex, so each shape on the way keeps out of it, and the energy never grows from one to the next. The
/// search ends when the pushes turn by less than kEnough of the force, and `Feel::error` says what is left.
///
/// The stiffnesses are the slopes of force and torque as the capsule moves and turns while the same nodes are pushed:
/// of how the pushes change, how their normals turn, and how the lever of each turns with the handle. Where E bends
/// downwards, as for a long handle that stands on its end and would fall over, the stiffness is 0: neither is ever
/// negative.
///
/// Valid while the contact is many nodes wide, as with SphereContact, and for small strains.
///
/// Thread-safe: no. Realtime-safe: no.
class CapsuleContact {
 public:
  /// `nodes`: those that can be touched, ascending; `radius` m, above 0; `half_length` m, from the middle to the centre
  /// of each end, 0 or more. Makes the compliance of the nodes by three solutions for each. Throws
  /// std::invalid_argument. Surface must outlive this.
  CapsuleContact(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, double radius,
                 double half_length);

  /// With the capsule's middle at `middle` (m), its axis along the unit vector `axis`, and the torque about the point
  /// `about` (m); body frame. Feel::torque is always there. There is no force when a number is not finite. Throws
  /// std::out_of_range when the capsule touches the body outside `nodes`, or where it is held.
  Feel at(const Vec3& middle, const Vec3& axis, const Vec3& about);

  /// Problems of `pushes.h` that the last answer took.
  int rounds() const noexcept { return rounds_; }

  std::size_t bytes() const noexcept;

  static constexpr double kEnough = 1e-6;

 private:
  /// A plane that touches the capsule.
  struct Plane {
    Vec3 point;   ///< m, where
    Vec3 normal;  ///< unit vector, out of the capsule
  };
  struct Capsule {
    Vec3 middle;
    Vec3 axis;
    double radius;
    double half_length;
    Vec3 nearest_of_axis(const Vec3& y) const;
    Plane nearest(const Vec3& y, const Vec3& otherwise) const;
    /// m, how far above x, along n, the capsule's lower side is; empty where it is nowhere above or below x.
    std::optional<double> above(const Vec3& x, const Vec3& n) const;
  };
  struct Node {
    Eigen::Index row;  ///< in nodes_
    Vec3 at_rest;
    Vec3 at;  ///< under the tool
    Plane plane;
  };
  std::vector<Node> near(const Capsule& tool, double& gap) const;
  void add_slopes(const Capsule& tool, const Vec3& about, const std::vector<Node>& nodes, const Pushes& pushes,
                  Feel& feel) const;
  void give_way(std::vector<Node>& nodes, const std::vector<Eigen::Index>& set, const VectorXd& push) const;

  const TouchSurface& surface_;
  double radius_;
  double half_length_;
  std::vector<Vec3> places_;          ///< m, at rest, of surface_.nodes()
  std::vector<Eigen::Index> row_of_;  ///< of surface_.nodes() in compliance_, in threes; −1: not in it
  MatrixXd compliance_;               ///< m/N
  std::vector<bool> pushed_;          ///< by row, in the last answer
  int rounds_ = 0;
};

}  // namespace tendon::softbody
