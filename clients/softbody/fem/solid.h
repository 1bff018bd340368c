// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"
#include "clients/softbody/fem/kernel.h"
#include "clients/softbody/fem/lazy.h"
#include "clients/softbody/fem/material.h"

namespace tendon::softbody {

/// A finite-element mesh of a material. Stateless. Thread-safe: yes, after construction. Realtime-safe: no.
class Solid : public Elastic {
 public:
  /// `of_elements`: the material of each element, if it is not uniform (region.h). Throws std::invalid_argument if the
  /// mesh is invalid, the element does not fit the mesh's shape, a material is invalid, or nothing is fixed.
  Solid(Mesh at_rest, Element element, const Material& material, Law law, const Fixed& fixed,
        std::vector<Material> of_elements = {});

  /// Returns some elements of another solid. `nodes` contains their node numbers in `whole`, in ascending order.
  static Solid part_of(const Solid& whole, const std::vector<int>& elements, std::vector<int>& nodes);

  Element element() const noexcept { return element_; }
  const Material& material() const noexcept { return material_; }
  const Material& material(int element) const { return of_elements_.empty() ? material_ : of_elements_[at(element)]; }
  const std::vector<Material>& of_elements() const noexcept { return of_elements_; }
  double largest_poisson() const;
  Law law() const noexcept { return law_; }

  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;

  int inverted(const VectorXd& u) const;         ///< number of elements with a quadrature point at which det F ≤ 0
  double largest_turn(const VectorXd& u) const;  ///< rad, largest rotation of the material at a quadrature point

  std::size_t bytes() const noexcept override;

  struct Point {
    double volume;  ///< m³
    double mu;      ///< Pa; 0 if only λ is integrated here
    double lambda;  ///< Pa; 0 if only µ is integrated here
  };
  int points_per_element() const noexcept { return per_element_; }
  const Point& point(int element, int index) const { return parts().points[at(element * per_element_ + index)]; }
  using Nodal = Kernel::Nodal;
  Kernel::Gradient gradient(int element, int point) const { return parts().kernel.gradient(element, point); }  ///< 1/m
  struct Part {  // point() and gradient(), computed without storing them, for one-time use
    Point point;
    Nodal gradient;
  };
  Part part(int element, int index) const;
  Nodal displacements(const VectorXd& u, int element) const;

 protected:
  /// Assembles the stiffness of a material with the tangent `tangent_at(element, point, F)`.
  template <class TangentAt>
  void sum_stiffness(const VectorXd& u, const TangentAt& tangent_at, SymmetricMatrix& to) const;

 private:
  Solid(Mesh at_rest, const Solid& whole, const Fixed& fixed, std::vector<Material> of_elements);

  struct Parts {
    std::vector<Point> points;
    Kernel kernel;
  };
  const Parts& parts() const {
    const Parts* const made = parts_.made();
    return made != nullptr ? *made : make_parts();
  }
  const Parts& make_parts() const;
  const std::vector<int>& slots() const;

  Element element_;
  Material material_;
  std::vector<Material> of_elements_;
  Law law_;
  int per_element_;
  Lazy<Parts> parts_;
  Lazy<std::vector<int>> slots_;  ///< index in the pattern's values, or −1
};

template <class TangentAt>
void Solid::sum_stiffness(const VectorXd& u, const TangentAt& tangent_at, SymmetricMatrix& to) const {
  std::ranges::fill(to.values, 0.0);
  const int nodes = nodes_of(mesh().shape);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 * kMaxNodes, 3 * kMaxNodes> k(3 * nodes, 3 * nodes);
  auto slot = slots().begin();
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    k.setZero();
    for (int q = 0; q < per_element_; ++q) {
      const auto g = gradient(e, q);
      const Mat9 a = point(e, q).volume * tangent_at(e, q, Mat3::Identity() + local * g.transpose());
      for (int j = 0; j < nodes; ++j) {
        Eigen::Matrix<double, 9, 3> strained = a.middleCols<3>(0) * g(0, j);
        strained += a.middleCols<3>(3) * g(1, j);
        strained += a.middleCols<3>(6) * g(2, j);
        for (int i = 0; i < nodes; ++i) {
          k.block<3, 3>(3 * i, 3 * j) += g(0, i) * strained.middleRows<3>(0) + g(1, i) * strained.middleRows<3>(3) +
                                         g(2, i) * strained.middleRows<3>(6);
        }
      }
    }
    for (const double entry : k.reshaped()) {
      if (*slot >= 0) to.values[at(*slot)] += entry;
      ++slot;
    }
  }
}

}  // namespace tendon::softbody
