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

/// Minimizes |G x − b| for x ≥ 0 with few entries (Lawson & Hanson 1974), added one at a time because the method stalls
/// with several. Ends if |G x − b| ≤ `left` |b|, at `most` entries, or if no other entry helps.
VectorXd few_not_negative(const Squares& squares, double left, int most);

}  // namespace tendon::softbody
