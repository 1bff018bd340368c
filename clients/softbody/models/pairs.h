// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// What the last steps of a solver taught of a stiffness whose factor is older: the inverse H of the stiffness by a kept
/// factor K₀ and up to eight pairs of a step and the forces that it changed (BFGS with limited memory; Nocedal 1980).
/// H maps the last change of forces to the last step exactly, and is positive definite when K₀ is.
///
/// What K₀⁻¹ makes of each change of forces is handed in: a solver that solves for the forces of each shape knows it, so
/// an answer of H costs no more solutions than one of K₀⁻¹.
///
/// Thread-safe: no. Realtime-safe: no.
class Pairs {
 public:
  static constexpr int kMost = 8;

  void clear() noexcept { order_.clear(); }

  /// `change` = the forces after `step` minus those before, N; `solved` = K₀⁻¹ `change`. A pair that shows no stiffness
  /// along its step is left out.
  void add(const VectorXd& step, const VectorXd& change, const VectorXd& solved);

  /// H b, from `solved` = K₀⁻¹ b.
  VectorXd times(const VectorXd& b, const VectorXd& solved) const;

  /// H − K₀⁻¹ among some of the unknowns: its rows and columns, in the order of `unknowns`.
  MatrixXd adds(const std::vector<int>& unknowns) const;

  int count() const noexcept { return static_cast<int>(order_.size()); }
  std::size_t bytes() const noexcept;

 private:
  using Small = Eigen::Matrix<double, kMost, kMost>;
  std::vector<int> order_;  ///< columns, the oldest first
  MatrixXd steps_;          ///< a column for each pair, as the next two
  MatrixXd changes_;
  MatrixXd solved_;
  Small steps_changes_;   ///< stepsᵀ changes
  Small changes_solved_;  ///< changesᵀ K₀⁻¹ changes
};

}  // namespace tendon::softbody
