// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Products with a matrix that is tall and dense, four numbers at a time as Kernel has them: the same bits on every
/// processor. A count of rows that is not a multiple of kLanes is refused (std::invalid_argument).
///
/// Thread-safe: yes. Realtime-safe: where `to` has its size.
void times(const MatrixXd& matrix, const VectorXd& x, VectorXd& to);
void times_transposed(const MatrixXd& matrix, const VectorXd& x, VectorXd& to);

}  // namespace tendon::softbody
