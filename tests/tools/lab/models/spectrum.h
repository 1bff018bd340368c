// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody::compared {

/// The vibration modes of a body: K x = ω² M x, with the masses M on the diagonal. By Lanczos' method (Spectra), to
/// 1e-6 or better.

/// The largest ω, rad/s. `mass` in kg, all above 0.
double fastest_swing(const SymmetricMatrix& stiffness, const VectorXd& mass);

/// The `count` slowest swings. Throws std::invalid_argument when `count` is not from 1 to the number of displacements,
/// std::runtime_error when the stiffness is not positive definite.
struct Swings {
  VectorXd squares;  ///< ω², 1/s², ascending
  MatrixXd shapes;   ///< a column for each, xᵀ M x = 1
};
Swings slowest_swings(const SymmetricMatrix& stiffness, const VectorXd& mass, int count);

}  // namespace tendon::softbody::compared
