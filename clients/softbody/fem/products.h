// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Products with a tall dense matrix, kLanes rows at a time, with bit-identical results on every processor. Throws
/// std::invalid_argument if the number of rows is not a multiple of kLanes.
/// Thread-safe: yes. Realtime-safe: if `to` already has its size.
void times(const MatrixXd& matrix, const VectorXd& x, VectorXd& to);
void times_transposed(const MatrixXd& matrix, const VectorXd& x, VectorXd& to);

}  // namespace tendon::softbody
