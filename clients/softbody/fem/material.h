// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// Energy densities Ψ(F), F = I + ∂u/∂X. All agree for small strains and are linear in µ and λ, as selective reduced
/// integration requires. J = det F, ε = sym(F − I), E = ½(FᵀF − I), R is the rotation of F's polar decomposition:
///
///     linear         µ ε:ε + ½ λ (tr ε)²                             rotations count as strain
///     corotational   µ |F − R|² + ½ λ (tr(RᵀF) − 3)²
///     StVK           µ E:E + ½ λ (tr E)²                             softens in compression, then stays inverted
///     Neo-Hookean    ½ µ (|F|² − 3) − µ (J − 1) + ½ (λ + µ) (J − 1)²   stable: finite and restoring for J ≤ 0
///
/// Sources: Müller & Gross 2004; Smith, de Goes & Kim 2018, without their barrier against collapse to a point.
enum class Law : std::uint8_t { kLinear, kCorotational, kStVenantKirchhoff, kNeoHookean };

struct Material {
  double young = 0;    ///< E, Pa; > 0
  double poisson = 0;  ///< ν, 0 ≤ ν < ½

  double mu() const noexcept { return young / (2 * (1 + poisson)); }
  double lambda() const noexcept { return young * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
};

void check(const Material& material);  ///< throws std::invalid_argument with the name of an invalid field

using Mat9 = Eigen::Matrix<double, 9, 9>;

/// The matrix of a linear map on 3 × 3 matrices, from its value `change(dF)` for each unit dF.
template <class Change>
Mat9 by_columns(const Change& change) {
  Mat9 all;
  for (int column = 0; column < 9; ++column) {
    Mat3 df = Mat3::Zero();
    df(column % 3, column / 3) = 1;
    const Mat3 dp = change(df);
    all.col(column) = dp.reshaped();
  }
  return all;
}

struct Stress {
  double energy;  ///< Ψ, J/m³
  Mat3 piola;     ///< P = ∂Ψ/∂F, Pa
};
Stress stress(Law law, const Mat3& f, double mu, double lambda);

/// Returns ∂P/∂F (Pa) with F and P as columns. The matrix is symmetric. It is indefinite if the material can buckle.
Mat9 tangent(Law law, const Mat3& f, double mu, double lambda);

/// The nearest positive semidefinite matrix. A Newton step with it is always a descent direction.
Mat9 without_negative(const Mat9& symmetric);

/// The rotation nearest to F (polar decomposition). Also a proper rotation if F is inverted.
Mat3 nearest_rotation(const Mat3& f);

}  // namespace tendon::softbody
