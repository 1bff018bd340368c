// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Quasi-Newton update of a kept factor: the inverse stiffness H from the factor K₀ and up to eight pairs of a step and
/// its change of forces (limited-memory BFGS; Nocedal 1980). H maps the last change of forces to the last step exactly,
/// and is positive definite if K₀ is.
///
/// K₀⁻¹ times each change of forces is passed in. A solver that solves for the forces at each shape already has it, so
/// applying H costs no more solves than K₀⁻¹.
///
/// Thread-safe: no. Realtime-safe: no.
class Pairs {
 public:
  static constexpr int kMost = 8;

  void clear() noexcept { order_.clear(); }

  /// `change` = forces after `step` minus those before, N; `solved` = K₀⁻¹ `change`. Skips a pair with no positive
  /// curvature along its step.
  void add(const VectorXd& step, const VectorXd& change, const VectorXd& solved);

  /// H b, given `solved` = K₀⁻¹ b.
  VectorXd times(const VectorXd& b, const VectorXd& solved) const;

  /// The submatrix of H − K₀⁻¹ for `unknowns`, in their order.
  MatrixXd adds(const std::vector<int>& unknowns) const;

  int count() const noexcept { return static_cast<int>(order_.size()); }
  std::size_t bytes() const noexcept;

 private:
  using Small = Eigen::Matrix<double, kMost, kMost>;
  std::vector<int> order_;  ///< column indices, oldest first
  MatrixXd steps_;          ///< one column per pair, as in the next two
  MatrixXd changes_;
  MatrixXd solved_;
  Small steps_changes_;   ///< stepsᵀ changes
  Small changes_solved_;  ///< changesᵀ K₀⁻¹ changes
};

}  // namespace tendon::softbody
