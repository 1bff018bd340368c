// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// The least-squares problem min
/// G x − b
/// ² in terms of its normal equations, so that G need not be stored.
struct Squares {
  MatrixXd gram;      ///< GᵀG
  VectorXd right;     ///< Gᵀb
  double square = 0;  ///< |b|²
};

/// A sparse x ≥ 0: adds entries until
/// G x − b
///  ≤ `left`
/// b
/// , `most` entries are positive, or no entry helps (Lawson & Hanson 1974). Adds one entry at a time, because several
/// at once stall. An entry that returns to 0 is excluded until another one has stayed.
VectorXd few_not_negative(const Squares& squares, double left, int most);

}  // namespace tendon::softbody
