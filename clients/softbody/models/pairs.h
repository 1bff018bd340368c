// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Limited-memory BFGS (Nocedal 1980) with a kept factor K₀ of the stiffness and up to eight pairs of a step and its
/// change of forces. The inverse H maps the last change of forces to the last step, and is positive definite if K₀ is.
/// The caller passes K₀⁻¹ times each change of forces, because it usually has this result already.
/// Thread-safe: no. Realtime-safe: no.
class Pairs {
 public:
  static constexpr int kMost = 8;

  void clear() noexcept { order_.clear(); }

  /// `change` is that of the forces by `step` (N), `solved` K₀⁻¹ `change`. Ignored if the curvature is not positive.
  void add(const VectorXd& step, const VectorXd& change, const VectorXd& solved);

  VectorXd times(const VectorXd& b, const VectorXd& solved) const;  ///< H b; `solved` is K₀⁻¹ b

  MatrixXd adds(const std::vector<int>& unknowns) const;  ///< rows and columns of H − K₀⁻¹ for `unknowns`

  int count() const noexcept { return static_cast<int>(order_.size()); }
  std::size_t bytes() const noexcept;

 private:
  using Small = Eigen::Matrix<double, kMost, kMost>;
  std::vector<int> order_;  ///< oldest first
  MatrixXd steps_;
  MatrixXd changes_;
  MatrixXd solved_;
  Small steps_changes_;
  Small changes_solved_;
};

}  // namespace tendon::softbody
