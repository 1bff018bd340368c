// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// The normal equations of min |G x − b|².
struct Squares {
  MatrixXd gram;      ///< GᵀG
  VectorXd right;     ///< Gᵀb
  double square = 0;  ///< |b|²
};

/// Minimizes |G x − b| over sparse x ≥ 0 (Lawson & Hanson 1974). Adds one entry at a time, since several at once stall,
/// until |G x − b| ≤ `left` |b|, `most` entries are positive, or no entry helps. An entry that returns to 0 is excluded
/// until another one has stayed.
VectorXd few_not_negative(const Squares& squares, double left, int most);

}  // namespace tendon::softbody
