// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// The nodes that a rigid tool without friction pushes, and how hard (Signorini's conditions).
struct Pushes {
  std::vector<Eigen::Index> set;  ///< the pushed nodes, ascending
  VectorXd push;                  ///< N, of each of them, not negative
  Eigen::LLT<MatrixXd> factor;    ///< of their rows and columns of the table
};

/// The pushes λ ≥ 0 of least energy ½ λᵀGλ − dᵀλ: a pushed node gives way by just its `depth` d (m), any other by at
/// least that. `table` G is how far each node gives way when another is pushed with 1 N (m/N, symmetric, positive
/// definite). The search is an active set; it begins with the nodes that are `active`, or with all of them when none
/// is, and leaves in `active` the nodes that are pushed. At least one depth is above 0.
Pushes least_pushes(const MatrixXd& table, const VectorXd& depth, std::vector<bool>& active);

}  // namespace tendon::softbody
