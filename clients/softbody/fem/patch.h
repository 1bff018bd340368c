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

/// The patch on which a tool presses, as nodal weights: the mean of a field over the patch is Σ wᵢ·fieldᵢ, and a force
/// F on the patch is F·wᵢ on each node. The weight density at distance r from the center is
///
///     p(r) = 3/(πa²) · (1 − (r/a)²)²,   r < a
///
/// integrated with the shape functions. The radius a is fixed because the stiffness under a patch converges under mesh
/// refinement; under a single node it does not (displacements grow as 1/r, Boussinesq).
struct Patch {
  std::vector<int> nodes;
  VectorXd weights;                                     ///< their sum is 1
  Eigen::Matrix<double, 2, Eigen::Dynamic> slopes;      ///< 1/m, ∂weights/∂(patch center)
  Eigen::Matrix<double, 3, Eigen::Dynamic> curvatures;  ///< 1/m², xx, xy, yy; empty unless requested
  double covered = 0;                                   ///< fraction of the patch area on the body, 0 … 1
  Vec2 middle = Vec2::Zero();                           ///< m, tangential coordinates
};

/// The touchable side of a body: the facets that face the tool, as a height field over the plane normal to `normal()`.
/// Thread-safe: yes, after construction. Realtime-safe: no.
class TouchSurface {
 public:
  /// `towards_tool` is a unit vector from the body to the tool; `radius` is the patch radius a, m. Facets tilted more
  /// than 75° from it are excluded. Throws std::invalid_argument if none remains.
  TouchSurface(const Mesh& mesh, const Vec3& towards_tool, double radius);

  const Vec3& normal() const noexcept { return normal_; }
  double radius() const noexcept { return radius_; }
  bool curved() const noexcept { return curved_; }

  /// Tangential coordinates of a position, m, and the inverse map.
  Vec2 across(const Vec3& position) const { return across_ * position; }
  Vec3 from_across(const Vec2& along) const { return across_.transpose() * along; }
  /// Maps a quadratic form in tangential coordinates to three dimensions.
  Mat3 form_from_across(const Mat2& form) const { return across_.transpose() * form * across_; }

  /// The nodes of all facets, and of the patches within `reach` (m) of `middle`.
  const std::vector<int>& nodes() const noexcept { return nodes_; }
  std::vector<int> nodes_of_patches(const Vec2& middle, double reach) const;

  /// The patch around `middle`; empty if less than `least_covered` of its area is on the body.
  std::optional<Patch> patch(const Vec2& middle, double least_covered = 0.5) const;

  std::optional<Patch> patch_with_curvatures(const Vec2& middle, double least_covered = 0.5) const;

  /// Tangential position of a node, and its height along the normal; m.
  const Vec2& place(int node) const { return places_[static_cast<std::size_t>(node)]; }
  double height(int node) const { return heights_[static_cast<std::size_t>(node)]; }

 private:
  struct Pieces {
    std::vector<int> nodes;                       ///< indices into nodes_
    Eigen::Matrix<double, 2, Eigen::Dynamic> at;  ///< m, centers of the pieces
    VectorXd area;                                ///< m² of each piece, projected along the normal
    MatrixXd shares;                              ///< of nodes (rows) in pieces (columns)
    Vec2 middle;
    double reach = 0;
  };

  void add(const Mesh& mesh, const Facet& facet);
  void look_for_a_curve();
  template <bool kCurved>
  std::optional<Patch> patch_around(const Vec2& middle, double least_covered) const;

  Vec3 normal_;
  double radius_;
  Eigen::Matrix<double, 2, 3> across_;
  std::vector<Vec2> places_;
  std::vector<double> heights_;
  std::vector<Pieces> facets_;
  std::vector<int> nodes_;
  bool curved_ = false;
};

}  // namespace tendon::softbody
