// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "clients/softbody/fem/mesh.h"
#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

using Vec2 = Eigen::Vector2d;
using Mat2 = Eigen::Matrix2d;

/// The patch on which a tool presses, as weights of nodes: the mean of any field over the patch is Σ wᵢ·fieldᵢ, and a
/// force F on it is F·wᵢ on each node. The weight of a point at the distance r from the middle is
///
///     p(r) = 3/(πa²) · (1 − (r/a)²)²,   r < a
///
/// with consistent shares for the nodes. The size a is fixed because the stiffness under a patch converges as the mesh
/// becomes finer; under a single node it does not (displacements go as 1/r, Boussinesq).
struct Patch {
  std::vector<int> nodes;                               ///< ascending
  VectorXd weights;                                     ///< their sum is 1
  Eigen::Matrix<double, 2, Eigen::Dynamic> slopes;      ///< 1/m, how the weights change as the middle moves
  Eigen::Matrix<double, 3, Eigen::Dynamic> curvatures;  ///< 1/m², ∂²weights: xx, xy, yy; empty unless asked for
  double covered = 0;                                   ///< the fraction of the patch that lies on the body, 0 … 1
  Vec2 middle = Vec2::Zero();                           ///< m, across
};

/// The side of a body that a tool can touch, seen along one direction: the facets that face it, as a height field over
/// the plane normal to it.
///
/// Thread-safe: yes, once built. Realtime-safe: no.
class TouchSurface {
 public:
  /// `towards_tool` is a unit vector, from the body to the tool; `radius` a, m. Facets more than 75° away from it
  /// are left out. Throws std::invalid_argument when none is left.
  TouchSurface(const Mesh& mesh, const Vec3& towards_tool, double radius);

  const Vec3& normal() const noexcept { return normal_; }
  double radius() const noexcept { return radius_; }
  /// True where what can be touched does not lie in one plane.
  bool curved() const noexcept { return curved_; }

  /// Position across the normal, m, and the way back.
  Vec2 across(const Vec3& position) const { return across_ * position; }
  Vec3 from_across(const Vec2& along) const { return across_.transpose() * along; }
  /// The same of a quadratic form.
  Mat3 form_from_across(const Mat2& form) const { return across_.transpose() * form * across_; }

  /// All nodes of the facets, ascending, and those of patches whose middle is within `reach` of `middle`.
  const std::vector<int>& nodes() const noexcept { return nodes_; }
  std::vector<int> nodes_of_patches(const Vec2& middle, double reach) const;

  /// The patch around `middle`; empty where less of it than `least_covered` lies on the body.
  std::optional<Patch> patch(const Vec2& middle, double least_covered = 0.5) const;

  /// The same with its curvatures.
  std::optional<Patch> patch_with_curvatures(const Vec2& middle, double least_covered = 0.5) const;

  /// A node's position across the normal, and its height along the normal; m.
  const Vec2& place(int node) const { return places_[static_cast<std::size_t>(node)]; }
  double height(int node) const { return heights_[static_cast<std::size_t>(node)]; }

 private:
  /// A facet, cut into small pieces.
  struct Pieces {
    std::vector<int> nodes;                       ///< of the facet, as indices of nodes_
    Eigen::Matrix<double, 2, Eigen::Dynamic> at;  ///< m, the middle of each piece, across
    VectorXd area;                                ///< m², of each, seen along the normal
    MatrixXd shares;                              ///< of the nodes (rows) in each piece (columns)
    Vec2 middle;
    double reach = 0;  ///< m, from the middle to the piece that is farthest from it
  };

  void add(const Mesh& mesh, const Facet& facet);
  void look_for_a_curve();
  template <bool kCurved>
  std::optional<Patch> patch_around(const Vec2& middle, double least_covered) const;

  Vec3 normal_;
  double radius_;
  Eigen::Matrix<double, 2, 3> across_;
  std::vector<Vec2> places_;  ///< of all nodes of the mesh, across
  std::vector<double> heights_;
  std::vector<Pieces> facets_;
  std::vector<int> nodes_;
  bool curved_ = false;
};

}  // namespace tendon::softbody
