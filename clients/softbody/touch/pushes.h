// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// The nodes pushed by a frictionless rigid tool, and their forces (Signorini's conditions).
struct Pushes {
  std::vector<Eigen::Index> set;  ///< pushed nodes, ascending
  VectorXd push;                  ///< N, per pushed node, ≥ 0
  Eigen::LLT<MatrixXd> factor;    ///< of the table's rows and columns of `set`
};

/// Minimizes ½ λᵀGλ − dᵀλ over λ ≥ 0: a pushed node moves by exactly its `depth` d (m), all others by at least theirs.
/// `table` is G, the displacement of each node per newton on another (m/N, symmetric positive definite). Active-set
/// method; starts from `active`, or from all nodes if none is active, and returns the pushed nodes there. At least one
/// depth must be positive.
Pushes least_pushes(const MatrixXd& table, const VectorXd& depth, std::vector<bool>& active);

}  // namespace tendon::softbody
