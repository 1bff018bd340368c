// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>

#include "core/base/reason.h"
#include "core/base/time.h"

namespace tendon {

// The port of a device: where energy passes between the hand and the device, as a force and a displacement. Ledgers
// and control laws speak of it in these words.

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int N>
using Mat = Eigen::Matrix<double, N, N>;

/// What happened at the port in the haptic period that has just ended.
template <int N>
struct Interval {
  Vec<N> applied;   ///< N, on the hand: the force that was **really held** in it
  Vec<N> dx;        ///< m, the displacement measured over it
  Duration held{};  ///< T_act, its measured length
};

/// What the remote environment asks for in the period that begins: its force where the hand is now, linearised.
///
///     F(x + ξ) ≈ force − stiffness · ξ
template <int N>
struct Demand {
  Vec<N> force;                       ///< N, on the hand
  Mat<N> stiffness = Mat<N>::Zero();  ///< −∂F/∂x, N/m; zero when nobody knows it
  Duration age{};                     ///< of the motion that `force` answers
};

/// This value of `permitted` means that the law does not bound the force.
inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

/// A force, and why it is not the one that was wanted.
template <int N>
struct LimitedForce {
  Vec<N> force;      ///< N, on the hand
  double permitted;  ///< N, the bound on ‖force‖ at this step, or kNoBound
  Reasons reasons;
};

}  // namespace tendon
