// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// A least squares problem min |G x − b|² by its products, so that G need not be kept.
struct Squares {
  MatrixXd gram;      ///< GᵀG
  VectorXd right;     ///< Gᵀb
  double square = 0;  ///< |b|²
};

/// x ≥ 0 with few entries above 0, until |G x − b| ≤ `left` |b|, or `most` entries, or none that helps is left (Lawson &
/// Hanson 1974). One entry is let in at a time: several at once stall. One that comes back to 0 is barred until another
/// has stayed.
VectorXd few_not_negative(const Squares& squares, double left, int most);

}  // namespace tendon::softbody
