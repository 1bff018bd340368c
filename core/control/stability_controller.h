// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <concepts>

#include "core/base/reason.h"
#include "core/base/time.h"

namespace tendon {

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int N>
using Mat = Eigen::Matrix<double, N, N>;

/// What happened at the port of the device in the haptic period that has just ended.
template <int N>
struct Interval {
  Vec<N> applied;   ///< N, on the hand: the force that was **really held** in it
  Vec<N> dx;        ///< m, the displacement measured over it
  Duration held{};  ///< T_act, its measured length
};

/// What is upstream asks for in the period that begins: the environment, linearised where the hand is now.
///
///     F(x + ξ) ≈ force − stiffness · ξ
template <int N>
struct Demand {
  Vec<N> force;                       ///< N, on the hand
  Mat<N> stiffness = Mat<N>::Zero();  ///< −∂F/∂x, N/m; zero when nobody knows it
};

/// A force, and why it is not the one that was wanted.
template <int N>
struct LimitedForce {
  Vec<N> force;      ///< N, on the hand
  double permitted;  ///< N, the bound on ‖force‖ at this step; ∞ for a law that has none
  Reasons reasons;
};

/// A law that makes the force at a device's port safe to feel: what every file of core/control implements.
///
/// Once in each haptic period, in this order: `observe` the interval that has just ended (not in the first
/// period, for which there is none), then `limit` what is wanted into the force to hold until the next one.
/// When the motion in an interval was not seen, `observe_unseen` takes the place of `observe`: the force
/// `applied` was held for at most `at_most`, and then vanished.
///
/// N is 1, 3 (forces in N, displacements in m) or 6 (joint torques in N·m and angles in rad, or a wrench and
/// a twist; each law says what it takes).
///
/// `energy` is the law's account of the port, J: the ledger E of Lee & Lee 2009 eq. (5) or a lower bound of
/// it. It is kept by laws too that do not act on it, so that every law can be judged by it.
///
/// A demand that is not finite gives zero force with Reason::kNotFinite; an interval that is not finite is
/// not booked.
///
/// Thread-safe: no. Realtime-safe: all of it.
template <class Law, int N>
concept StabilityController = requires(Law law, const Interval<N>& interval, const Vec<N>& applied, Duration at_most,
                                       const Demand<N>& demand) {
  { law.observe(interval) }
  noexcept;
  { law.observe_unseen(applied, at_most) }
  noexcept;
  { law.limit(demand) }
  noexcept->std::same_as<LimitedForce<N>>;
  { law.energy() }
  noexcept->std::convertible_to<double>;
};

}  // namespace tendon
