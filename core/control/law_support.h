// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"
#include "core/control/stability_controller.h"

/// What the laws of core/control do in the same way. A part of their implementation, not of their interface.
namespace tendon::law_support {

/// T_max in seconds. Throws std::invalid_argument unless it is above zero.
inline double checked_hold(Duration longest_hold) {
  expect_above_zero(seconds(longest_hold), "longest_hold");
  return seconds(longest_hold);
}

/// b. Throws std::invalid_argument unless it is above zero: for a law that lives on viscous friction alone.
inline double checked_viscous(double viscous) {
  expect_above_zero(viscous, "friction.viscous");
  return viscous;
}

/// Finite, and its squares too.
template <int N>
bool finite(const Interval<N>& interval) noexcept {
  return std::isfinite(interval.applied.squaredNorm()) && std::isfinite(interval.dx.squaredNorm());
}

template <int N>
bool finite(const Demand<N>& demand) noexcept {
  return demand.force.allFinite() && demand.stiffness.allFinite();
}

/// The answer to a demand that is not finite.
template <int N>
LimitedForce<N> refused(double permitted) noexcept {
  return {Vec<N>::Zero(), permitted, Reason::kNotFinite};
}

/// `v`, shortened to `length` if it is longer; its direction is kept.
template <int N>
Vec<N> shortened(const Vec<N>& v, double length) noexcept {
  const double size = v.stableNorm();
  return size <= length ? v : Vec<N>(v * (length / size));
}

/// The wanted force within `bound`, with the reason if that changed it.
template <int N>
LimitedForce<N> bounded(const Vec<N>& wanted, double bound, Reason reason) noexcept {
  if (wanted.stableNorm() <= bound) return {wanted, bound, {}};
  return {shortened<N>(wanted, bound), bound, reason};
}

/// A symmetric matrix along its own axes.
template <int N>
struct Principal {
  Vec<N> values;   ///< eigenvalues, ascending
  Mat<N> vectors;  ///< column i belongs to values[i]; orthonormal
};

/// The symmetric part of a stiffness, N/m, along its own axes: its potential energy has no other. N = 1, 3, 6.
template <int N>
Principal<N> principal_stiffness(const Mat<N>& stiffness) noexcept;

/// The largest singular value of a stiffness, N/m: no displacement changes the force faster. N = 1, 3, 6.
template <int N>
double spectral_norm(const Mat<N>& stiffness) noexcept;

}  // namespace tendon::law_support
