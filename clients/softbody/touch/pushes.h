// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// The nodes that a rigid tool pushes without friction (Signorini's conditions).
struct Pushes {
  std::vector<Eigen::Index> set;
  VectorXd push;  ///< N
  Eigen::LLT<MatrixXd> factor;
};

/// Minimizes ½ λᵀGλ − dᵀλ for λ ≥ 0. A pushed node moves by its `depth` d (m), and all others by at least theirs.
/// `table` is G, the displacement of each node for 1 N on another (m/N, positive definite). The search starts with the
/// `active` nodes, or with all nodes if there are none, and updates them. At least one depth must be positive.
Pushes least_pushes(const MatrixXd& table, const VectorXd& depth, std::vector<bool>& active);

}  // namespace tendon::softbody
