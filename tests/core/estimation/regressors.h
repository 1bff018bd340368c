// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "tests/support/dice.h"

namespace tendon {

inline double gaussian(Dice& dice) {
  const double size = std::sqrt(-2 * std::log(1 - dice.uniform()));
  return size * std::cos(2 * std::numbers::pi * dice.uniform());
}

/// Returns s, s + 1e-4 r and a constant: nearly parallel regressors, which are hard for a covariance update.
template <class Scalar>
Eigen::Matrix<Scalar, 3, 1> nearly_collinear(Dice& dice) {
  const double s = gaussian(dice);
  return {static_cast<Scalar>(s), static_cast<Scalar>(s + 1e-4 * gaussian(dice)), Scalar(1)};
}

}  // namespace tendon
