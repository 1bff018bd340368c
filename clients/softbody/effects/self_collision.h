// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// Keeps the sides of one body from overlapping. If a node of the surface is behind a facet by g > 0 m, springs push
/// both sides apart with the pressure c·g. Each side contributes one half:
///
///     energy = Σ ½ kᵢ gᵢ²,   gᵢ = max(0, −n·(xᵢ − y)),   kᵢ = ½ c Aᵢ
///
/// y is the nearest point of the facet, n its normal, and Aᵢ the area of the node at rest. The forces on node and facet
/// are opposite and collinear (Hallquist, Goudreau & Benson 1985). The facet, y and n are constant during a solution
/// and then updated until they do not change. y is the nearest point, so the forces are the gradient of the energy.
///
/// Facets are divided into triangles around their centers and extend a little beyond their edges. A facet does not push
/// a node if an element of the node has a node on the facet. Not detected are folds over fewer than two elements, edges
/// that cross edges, and sides that overlapped by more than half a facet before the first search.
///
/// Thread-safe: no. Realtime-safe: no.
class SelfCollision {
 public:
  /// `bed` is c in Pa/m. `elastic` must outlive this object. Throws std::invalid_argument if `bed` is not positive.
  SelfCollision(const Elastic& elastic, double bed, const VectorXd& u);

  double look(const VectorXd& u);  ///< relative change of the forces (0 … 2)

  VectorXd free_forces(const VectorXd& u) const { return elastic_.to_free(forces(u)); }
  /// Adds the energy and the free forces of the bed to `to`.
  void add_forces(const VectorXd& u, Elastic::Forces& to) const;

  /// Predicts the nodes that are pushed at the end of a Newton step, because a step without this prediction would make
  /// no progress. The step d minimizes ½ dᵀK d − d·b + energy(u + d). If `held` is given, held·d is equal to `by`, and
  /// the force (N) along `held` is returned. `factor` is the factor of K. For the forces on the nodes this is a linear
  /// complementarity problem, solved by projected Gauss–Seidel iteration (Cottle, Pang & Stone 1992, chapter 5).
  double foresee(const Factor& factor, const VectorXd& u, const VectorXd& b, const VectorXd* held, double by);

  bool pushes(const VectorXd& u) const;  ///< true if a node is pushed at u or at the end of the step

  /// Returns the change of the free forces if exactly the predicted nodes are pushed.
  VectorXd foreseen_forces(const VectorXd& u) const;

  /// Solves (K + bed stiffness) x = b by columns, with the `factor` of K and a solve for each pushed node (Woodbury).
  MatrixXd solve(const Factor& factor, const MatrixXd& b) const;

  double overlap(const VectorXd& u) const;
  std::size_t bytes() const noexcept;

 private:
  struct Point {  // a weighted sum of nodes
    std::vector<int> nodes;
    std::vector<double> shares;
  };
  struct Side {
    int first_triangle;
    int triangles;
    double size;  ///< m, root of the area at rest
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
  struct Pair {  // a node and a facet point: gap(u) = offset + Σ along·u = n·(xᵢ − y)
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
