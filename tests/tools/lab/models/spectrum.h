// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody::compared {

/// K x = ω² M x with diagonal mass matrix M, by Lanczos' method (Spectra) with relative error of at most 1e-6.

/// rad/s. `mass` in kg, all positive.
double fastest_swing(const SymmetricMatrix& stiffness, const VectorXd& mass);

/// The `count` slowest modes. Throws std::invalid_argument unless `count` is from 1 to the number of displacements,
/// std::runtime_error unless the stiffness is positive definite.
struct Swings {
  VectorXd squares;  ///< ω², 1/s², ascending
  MatrixXd shapes;   ///< one column per mode, xᵀ M x = 1
};
Swings slowest_swings(const SymmetricMatrix& stiffness, const VectorXd& mass, int count);

}  // namespace tendon::softbody::compared
