// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "clients/softbody/elastic.h"
#include "clients/softbody/material.h"

namespace tendon::softbody {

/// A mesh of a material: finite elements.
///
/// Without state. Thread-safe: yes, once built. Realtime-safe: no.
class Solid : public Elastic {
 public:
  /// Throws std::invalid_argument when the mesh is not sound, the element is not of the mesh's shape, the material is
  /// impossible or nothing is fixed.
  Solid(Mesh at_rest, Element element, const Material& material, Law law, const Fixed& fixed);

  Element element() const noexcept { return element_; }
  const Material& material() const noexcept { return material_; }
  Law law() const noexcept { return law_; }

  double energy(const VectorXd& u) const override;
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;

  /// Elements with a point at which det F ≤ 0.
  int inverted(const VectorXd& u) const;
  /// rad, the largest angle by which the material is turned at a point of integration.
  double largest_turn(const VectorXd& u) const;

  std::size_t bytes() const noexcept override;

  /// A point of integration: the part of an element that it stands for, and of which of its moduli.
  struct Point {
    double volume;  ///< m³
    double mu;      ///< Pa; 0 where only λ is integrated
    double lambda;  ///< Pa; 0 where only µ is
  };
  int points_per_element() const noexcept { return per_element_; }
  const Point& point(int element, int index) const { return points_[at(element * per_element_ + index)]; }
  using Nodal = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes>;
  Eigen::Map<const Nodal> gradient(int element, int point) const;  ///< ∂Nᵢ/∂X there, 1/m
  Nodal displacements(const VectorXd& u, int element) const;       ///< of an element's nodes, m

 private:
  void place(const QuadraturePoint& point, std::span<const int> nodes);
  void connect();

  Element element_;
  Material material_;
  Law law_;
  int per_element_;                ///< points of integration
  std::vector<Point> points_;      ///< of each element, one after the other
  std::vector<double> gradients_;  ///< ∂N/∂X of each point: 3 × nodes
  std::vector<int> slots_;         ///< where each entry of an element's lower triangle goes; −1: nowhere
};

}  // namespace tendon::softbody
