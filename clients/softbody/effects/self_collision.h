// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// Keeps the sides of one body from overlapping, in a fold, at a flap, or where a cut closes again. Where a node
/// of the surface lies g > 0 m behind a facet that faces it, a bed of springs between the two sides pushes them apart
/// with the pressure c·g, half of it from the nodes of either side:
///
///     energy = Σ ½ kᵢ gᵢ²,   gᵢ = max(0, −n·(xᵢ − y)),   kᵢ = ½ c Aᵢ
///
/// with y the point of the facet that is nearest, n the facet's normal out of the body, and Aᵢ the node's share of the
/// surface at rest. Node and facet are pushed by equal and opposite forces on one line (node to segment, by penalty:
/// Hallquist, Goudreau & Benson 1985). The facet of each node, the position of y on it and n are kept during a
/// solution, and looked up again in the new shape until that changes nothing: because y is the nearest point, the
/// forces are then the gradient of the energy. Facets extend a little beyond their rims.
///
/// Facets are divided into flat triangles around their centres. A facet never pushes a node when one of the node's
/// elements has a node on that facet. Not detected: folds over less than two elements, edges that cross edges, and
/// sides that overlapped by more than half a facet before the first search.
///
/// Thread-safe: no. Realtime-safe: no.
class SelfCollision {
 public:
  /// `bed` c, Pa/m; looks at `u` (m, all nodes). `elastic` must outlive this. Throws std::invalid_argument when `bed`
  /// is not above 0.
  SelfCollision(const Elastic& elastic, double bed, const VectorXd& u);

  /// Looks up the neighbours at u. Returns the relative change of the forces there, 0 … 2.
  double look(const VectorXd& u);

  VectorXd free_forces(const VectorXd& u) const { return elastic_.to_free(forces(u)); }  ///< ∂energy/∂u, N
  /// Adds the bed's energy and its forces on free displacements to those of elasticity.
  void add_forces(const VectorXd& u, Elastic::Forces& to) const;

  /// A Newton step must know which nodes will be pushed at its end, because the bed only pushes, and a step that does
  /// not expect it makes no progress. This selects the nodes that are pushed by the step d that makes
  ///
  ///     ½ dᵀK d − d·b + energy(u + d)
  ///
  /// least, among all steps, or among those with held·d = `by` if `held` is given; `factor` is that of K. Returns the
  /// force along `held`, N. With the forces on the nodes as unknowns it is a linear complementarity problem with a
  /// positive definite matrix, solved by Gauss and Seidel's method with projection (Cottle, Pang & Stone 1992, chapter
  /// 5).
  double foresee(const Factor& factor, const VectorXd& u, const VectorXd& b, const VectorXd* held, double by);

  /// Whether any node is pushed at u, or will be at the end of the step.
  bool pushes(const VectorXd& u) const;

  /// The forces on the free displacements at u if exactly those nodes are pushed, or pulled, minus the present forces.
  VectorXd foreseen_forces(const VectorXd& u) const;

  /// Solves (K + the bed's stiffness at those nodes) x = b for each column; `factor` is that of K. By Woodbury's
  /// identity: it costs one solution for each node, and K's factor and pattern stay as they are.
  MatrixXd solve(const Factor& factor, const MatrixXd& b) const;

  double overlap(const VectorXd& u) const;  ///< m, the largest distance of a node behind its facet
  std::size_t bytes() const noexcept;

 private:
  /// A point of a facet, by the nodes that it moves with.
  struct Point {
    std::vector<int> nodes;
    std::vector<double> shares;
  };
  struct Side {
    int first_triangle;
    int triangles;
    double size;             ///< m, the root of its area at rest
    std::vector<int> nodes;  ///< on it
  };
  struct Triangle {
    int side;
    std::array<int, 3> points;
  };
  /// A triangle as it lies now.
  struct Flat;
  struct SurfaceNode {
    int node;
    double stiffness;       ///< kᵢ, N/m
    std::vector<int> ring;  ///< the nodes of its elements, ascending
  };
  /// A node at a facet: gap(u) = offset + Σ along·u is n·(xᵢ − y).
  struct Pair {
    int node;
    double stiffness;
    double offset;
    std::vector<int> nodes;   ///< the node itself, then those of y
    std::vector<Vec3> along;  ///< n, then −share·n
    bool pushed = false;      ///< at the end of the step, as predicted

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
