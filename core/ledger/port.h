// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>

#include "core/base/reason.h"
#include "core/base/time.h"

namespace tendon {

// The hand and the device exchange energy through a port. The energy is the product of a force and a displacement.

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int N>
using Mat = Eigen::Matrix<double, N, N>;

/// The measurements of the port in the last haptic period.
template <int N>
struct Interval {
  Vec<N> applied;   ///< N, the force that was actually applied to the hand
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

/// Used for LimitedForce::permitted if a law has no bound.
inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

template <int N>
struct LimitedForce {
  Vec<N> force;      ///< N, on the hand
  double permitted;  ///< N, the bound on ‖force‖ in this step, or kNoBound
  Reasons reasons;
};

}  // namespace tendon
