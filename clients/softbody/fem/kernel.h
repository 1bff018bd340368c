// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Four numbers processed together. GCC and Clang vector extensions compile on every processor; without registers of
/// this width they become two half-width vectors or four scalars.
inline constexpr std::size_t kLanes = 4;
using Lanes [[gnu::vector_size(sizeof(double) * kLanes)]] = double;

/// Energy and forces of elements of one shape and law, four elements at a time. Everything independent of the
/// displacements is stored as a structure of arrays, with the values of four elements next to each other. The order of
/// summation does not depend on the processor, so results are bit-identical with and without wide registers.
/// Thread-safe: yes, after construction. Realtime-safe: only add_forces().
class Kernel {
 public:
  Kernel(Law law, int nodes, int points);  ///< creates an empty kernel for elements with 4, 8, 20 or 27 nodes

  using Nodal = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes>;
  using Gradient = Eigen::Map<const Nodal, 0, Eigen::Stride<3 * kLanes, kLanes>>;

  /// Appends an element. set_point() then sets its quadrature points: ∂Nᵢ/∂X in 1/m, and µ and λ times volume in J.
  void add_element(std::span<const int> nodes);
  void set_point(int element, int point, const Nodal& gradient, double mu, double lambda);
  Gradient gradient(int element, int point) const;

  int elements() const noexcept { return elements_; }

  double add_forces(const VectorXd& u, VectorXd& force) const;  ///< adds ∂energy/∂u (N) at u (m); returns J

  std::size_t bytes() const noexcept;

 private:
  std::size_t group(int element, int point) const {
    return at(element / static_cast<int>(kLanes)) * at(points_) + at(point);
  }
  template <Law kLaw, int kNodes>
  double sum(const double* u, double* force) const;
  template <Law kLaw>
  double sum(const double* u, double* force) const;

  Law law_;
  int per_element_;
  int points_;
  int elements_ = 0;
  std::vector<int> nodes_;
  /// Per point and group of four elements: 3 × nodes lanes of ∂N/∂X, and two lanes of moduli. The last group is padded.
  std::vector<double> gradients_;
  std::vector<double> moduli_;
};

}  // namespace tendon::softbody
