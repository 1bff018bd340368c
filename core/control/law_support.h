// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/base/expect.h"
#include "core/control/stability_controller.h"

/// Implementation details of the laws.
namespace tendon::law_support {

/// Returns T_max in seconds. Throws std::invalid_argument if it is not positive.
inline double checked_hold(Duration longest_hold) {
  expect_above_zero(seconds(longest_hold), "longest_hold");
  return seconds(longest_hold);
}

/// Returns b. Throws std::invalid_argument if it is not positive.
inline double checked_viscous(double viscous) {
  expect_above_zero(viscous, "friction.viscous");
  return viscous;
}

/// Returns T(make(0)), …, T(make(Count − 1)), for a T without a default constructor.
template <class T, std::size_t Count, class Make>
std::array<T, Count> each(const Make& make) {
  return [&make]<std::size_t... I>(std::index_sequence<I...>) { return std::array<T, Count>{T(make(I))...}; }
  (std::make_index_sequence<Count>());
}

/// Returns true if all values and their squares are finite.
template <int N>
bool finite(const Interval<N>& interval) noexcept {
  return std::isfinite(interval.applied.squaredNorm()) && std::isfinite(interval.dx.squaredNorm());
}

template <int N>
bool finite(const Demand<N>& demand) noexcept {
  return demand.force.allFinite() && demand.stiffness.allFinite();
}

template <int N>
LimitedForce<N> refused(double permitted) noexcept {
  return {Vec<N>::Zero(), permitted, Reason::kNotFinite};
}

template <int N>
Vec<N> shortened(const Vec<N>& v, double length) noexcept {
  const double size = v.stableNorm();
  return size <= length ? v : Vec<N>(v * (length / size));
}

/// Reduces the wanted force if its norm is larger than `bound`. If the force was larger, `reason` is set.
template <int N>
LimitedForce<N> bounded(const Vec<N>& wanted, double bound, Reason reason) noexcept {
  if (wanted.stableNorm() <= bound) return {wanted, bound, {}};
  return {shortened<N>(wanted, bound), bound, reason};
}

template <int N>
struct Principal {
  Vec<N> values;   ///< eigenvalues, ascending
  Mat<N> vectors;  ///< column i belongs to values[i]; orthonormal
};

/// Decomposes the symmetric part of a stiffness (N/m), which alone defines its potential energy. N = 1, 3, 6.
template <int N>
Principal<N> principal_stiffness(const Mat<N>& stiffness) noexcept;

/// The largest singular value of a stiffness (N/m) is the largest slope of the force. N = 1, 3, 6.
template <int N>
double spectral_norm(const Mat<N>& stiffness) noexcept;

}  // namespace tendon::law_support
