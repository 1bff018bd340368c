// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// Keeps the sides of one body from overlapping, in a fold, at a flap, or where a cut closes. If a surface node lies g
/// > 0 m behind a facet that faces it, a bed of springs between the two sides pushes them apart with the pressure c·g,
/// half of it from the nodes of either side:
///
///     energy = Σ ½ kᵢ gᵢ²,   gᵢ = max(0, −n·(xᵢ − y)),   kᵢ = ½ c Aᵢ
///
/// with y the nearest point of the facet, n the facet's outward normal, and Aᵢ the node's share of the surface at rest.
/// Node and facet receive equal and opposite collinear forces (node-to-segment penalty: Hallquist, Goudreau & Benson
/// 1985). The facet of each node, the position of y on it and n are fixed during a solution and updated in the new
/// shape until nothing changes; because y is the nearest point, the forces are then the gradient of the energy. Facets
/// extend slightly beyond their edges.
///
/// Facets are divided into flat triangles around their centers. A facet never pushes a node if one of the node's
/// elements has a node on that facet. Not detected: folds over fewer than two elements, edge-edge contact, and sides
/// that overlapped by more than half a facet before the first search.
///
/// Thread-safe: no. Realtime-safe: no.
class SelfCollision {
 public:
  /// `bed` is c in Pa/m. `elastic` must outlive this object. Throws std::invalid_argument if `bed` is not positive.
  SelfCollision(const Elastic& elastic, double bed, const VectorXd& u);

  /// Updates the neighbors at u. Returns the relative change of the forces, between 0 and 2.
  double look(const VectorXd& u);

  VectorXd free_forces(const VectorXd& u) const { return elastic_.to_free(forces(u)); }  ///< ∂energy/∂u, N
  /// Adds the energy and the free forces of the bed to `to`.
  void add_forces(const VectorXd& u, Elastic::Forces& to) const;

  /// A Newton step must predict which nodes are in contact at its end: the bed only pushes, and a step that ignores
  /// this makes no progress. Selects the nodes that are pushed by the step d that minimizes
  ///
  ///     ½ dᵀK d − d·b + energy(u + d)
  ///
  /// over all steps, or over those with held·d = `by` if `held` is given; `factor` is that of K. Returns the force
  /// along `held`, N. In terms of the nodal forces this is a linear complementarity problem with a positive definite
  /// matrix, solved by projected Gauss–Seidel (Cottle, Pang & Stone 1992, chapter 5).
  double foresee(const Factor& factor, const VectorXd& u, const VectorXd& b, const VectorXd* held, double by);

  /// Returns true if a node is pushed at u or at the end of the step.
  bool pushes(const VectorXd& u) const;

  /// Returns the change of the free forces if exactly the predicted nodes are pushed.
  VectorXd foreseen_forces(const VectorXd& u) const;

  /// Solves (K + bed stiffness) x = b for each column. `factor` is the factor of K. This needs one solve for each
  /// pushed node (Woodbury's identity).
  MatrixXd solve(const Factor& factor, const MatrixXd& b) const;

  double overlap(const VectorXd& u) const;
  std::size_t bytes() const noexcept;

 private:
  /// A weighted sum of nodes.
  struct Point {
    std::vector<int> nodes;
    std::vector<double> shares;
  };
  struct Side {
    int first_triangle;
    int triangles;
    double size;  ///< m, square root of its area at rest
    std::vector<int> nodes;
  };
  struct Triangle {
    int side;
    std::array<int, 3> points;
  };
  struct Flat;
  struct SurfaceNode {
    int node;
    double stiffness;       ///< kᵢ, N/m
    std::vector<int> ring;  ///< ascending
  };
  /// A node and a facet point: gap(u) = offset + Σ along·u = n·(xᵢ − y).
  struct Pair {
    int node;
    double stiffness;
    double offset;
    std::vector<int> nodes;  ///< first the node itself
    std::vector<Vec3> along;
    bool pushed = false;  ///< prediction for the end of the step

    double gap(const VectorXd& u) const;
    void add(double force, VectorXd& to) const;
  };

  void add(const Facet& facet);
  Vec3 place(const VectorXd& u, int node) const { return elastic_.mesh().nodes[at(node)] + u.segment<3>(3 * node); }
  std::vector<Flat> lie(const VectorXd& u) const;
  std::vector<Vec3> node_normals(const std::vector<Flat>& flats) const;
  Pair pair(const SurfaceNode& node, int triangle, const Vec3& shares, const Flat& flat) const;
  VectorXd forces(const VectorXd& u) const;
  MatrixXd directions(const std::vector<const Pair*>& pairs) const;

  const Elastic& elastic_;
  std::vector<Point> points_;
  std::vector<Triangle> triangles_;
  std::vector<Side> sides_;
  std::vector<SurfaceNode> nodes_;
  std::vector<Pair> pairs_;
};

}  // namespace tendon::softbody
