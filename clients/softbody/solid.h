// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/softbody/material.h"
#include "clients/softbody/mesh.h"
#include "clients/softbody/sparse.h"

namespace tendon::softbody {

/// Which displacements are given, and which are to be found. Component c of node i has the number 3 i + c.
using Fixed = std::vector<bool>;

/// The number 3 i + c of every component of every node for which `holds(position)`.
template <class Predicate>
Fixed fix_where(const Mesh& mesh, Predicate holds) {
  Fixed fixed(3 * mesh.nodes.size());
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const bool held = holds(mesh.nodes[i]);
    for (std::size_t c = 0; c < 3; ++c) fixed[3 * i + c] = held;
  }
  return fixed;
}

/// A mesh of a material: its elastic energy and the first two derivatives, by the displacements u (m, all nodes).
///
/// Without state. Thread-safe: yes, once built. Realtime-safe: no.
class Solid {
 public:
  /// Throws std::invalid_argument when the mesh is not sound, the element is not of the mesh's shape, the material is
  /// impossible or nothing is fixed.
  Solid(Mesh mesh, Element element, const Material& material, Law law, Fixed fixed);

  const Mesh& mesh() const noexcept { return mesh_; }
  Element element() const noexcept { return element_; }
  Law law() const noexcept { return law_; }

  int size() const noexcept { return static_cast<int>(free_of_.size()); }  ///< of u: 3 for each node
  int free_count() const noexcept { return static_cast<int>(all_of_.size()); }
  int free_of(int component) const noexcept;  ///< its number among the free ones, or −1
  VectorXd to_free(const VectorXd& all) const;
  void add_free(const VectorXd& free, VectorXd& all) const;  ///< all += free; the fixed ones stay

  double energy(const VectorXd& u) const;  ///< J
  /// ∂energy/∂u, N: what must act on the nodes from outside to hold them there.
  struct Forces {
    double energy;
    VectorXd force;
  };
  Forces forces(const VectorXd& u) const;

  enum class Curvature : std::uint8_t { kExact, kWithoutNegative };
  /// The second derivative by the free displacements, N/m.
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const;
  /// Its pattern, with zeros.
  SymmetricMatrix pattern() const { return pattern_; }

  /// Elements with a point at which det F ≤ 0.
  int inverted(const VectorXd& u) const;

  std::size_t bytes() const noexcept;

 private:
  struct Point {
    double volume;  ///< m³
    double mu;
    double lambda;
  };
  using Nodal = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes>;

  void place(const QuadraturePoint& point, std::span<const int> nodes);
  void connect();
  Nodal displacements(const VectorXd& u, int element) const;
  Eigen::Map<const Nodal> gradient(int element, int point) const;

  Mesh mesh_;
  Element element_;
  Law law_;
  double mu_;
  double lambda_;
  int per_element_;                ///< points of integration
  std::vector<int> free_of_;       ///< by component
  std::vector<int> all_of_;        ///< by free component
  std::vector<Point> points_;      ///< of each element, one after the other
  std::vector<double> gradients_;  ///< ∂N/∂X of each point: 3 × nodes
  SymmetricMatrix pattern_;
  std::vector<int> slots_;  ///< where each entry of an element's lower triangle goes; −1: nowhere
};

}  // namespace tendon::softbody
