// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>

#include "core/base/reason.h"
#include "core/base/time.h"

namespace tendon {

// The port of a device is where energy flows between the hand and the device, as a force times a displacement.

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int N>
using Mat = Eigen::Matrix<double, N, N>;

/// The measurements of the port in the last haptic period.
template <int N>
struct Interval {
  Vec<N> applied;   ///< N, the force on the hand that was really applied
  Vec<N> dx;        ///< m, measured displacement
  Duration held{};  ///< T_act, measured length
};

/// The force that the remote environment requests for the next period, linearized at the current position of the hand:
///     F(x + ξ) ≈ force − stiffness · ξ
template <int N>
struct Demand {
  Vec<N> force;                       ///< N, on the hand
  Mat<N> stiffness = Mat<N>::Zero();  ///< −∂F/∂x, N/m; zero if unknown
  Duration age{};                     ///< age of the motion that `force` answers
};

/// Value of LimitedForce::permitted for a law without a bound.
inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

template <int N>
struct LimitedForce {
  Vec<N> force;      ///< N, on the hand
  double permitted;  ///< N, the bound on ‖force‖ in this step, or kNoBound
  Reasons reasons;
};

}  // namespace tendon
