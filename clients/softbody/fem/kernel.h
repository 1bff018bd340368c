// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Four numbers on which the same is done. GCC's and Clang's vectors compile on every processor: where it has no
/// registers of this width, they become two of half of it, or four numbers.
inline constexpr std::size_t kLanes = 4;
using Lanes [[gnu::vector_size(sizeof(double) * kLanes)]] = double;

/// Energy and forces of elements of one shape and law, four at a time. What does not depend on the displacements is
/// kept as a structure of arrays: of four elements each number lies beside the others'. No step of the sum depends on
/// the processor, so results are the same, bit for bit, where it has registers for four numbers and where it has not.
///
/// Thread-safe: yes, once built. Realtime-safe: adding forces is.
class Kernel {
 public:
  /// Of elements with so many nodes (4, 8, 20 or 27) and points of integration; has no elements yet.
  Kernel(Law law, int nodes, int points);

  using Nodal = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxNodes>;
  using Gradient = Eigen::Map<const Nodal, 0, Eigen::Stride<3 * kLanes, kLanes>>;

  /// One more element, and the part of it at each of its points: ∂Nᵢ/∂X, 1/m; µ and λ times the volume, J.
  void add_element(std::span<const int> nodes);
  void set_point(int element, int point, const Nodal& gradient, double mu, double lambda);
  Gradient gradient(int element, int point) const;

  int elements() const noexcept { return elements_; }

  /// Adds ∂energy/∂u at u (m, all nodes) to `force`, N. Returns the energy, J.
  double add_forces(const VectorXd& u, VectorXd& force) const;

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
  int per_element_;  ///< nodes
  int points_;       ///< of an element
  int elements_ = 0;
  std::vector<int> nodes_;  ///< of each element, one after the other
  /// Of each point of four elements: 3 × nodes lanes of ∂N/∂X, and two of the moduli. Zero where the last four are not
  /// full.
  std::vector<double> gradients_;
  std::vector<double> moduli_;
};

}  // namespace tendon::softbody
