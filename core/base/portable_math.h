// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

/// Functions of doubles with bitwise identical results on every processor, compiler and C library.
///
/// The functions of libm can differ: glibc uses other instructions on processors with FMA, and its versions can round
/// the last bit differently. In a simulation with an encoder, a single different bit leads to a different run. These
/// functions only use + − · ÷ √, rounding to integers and std::fmod, which are exact or correctly rounded in IEEE 754,
/// in a fixed order. Compile with -ffp-contract=off (as in CMakeLists.txt), because fused multiply-add rounds once.
///
/// Unless noted otherwise, the error is less than the maximum of 1e-16 and 2e-16 of the result. NaN gives NaN.
/// Realtime-safe: yes.
namespace tendon::portable {

/// Rounds to the nearest integer, halves away from zero; |x| below 2⁶².
std::int64_t round(double x) noexcept;

/// Natural logarithm. x must be positive, normal and finite.
double log(double x) noexcept;

/// eˣ. If x is in −700 … 700, the relative error is less than 1e-15. Returns 0 below −700 and ∞ above 709.
double exp(double x) noexcept;

/// Returns eˣ − 1 without losing precision near zero.
double expm1(double x) noexcept;

/// Returns exactly ±1 for |x| ≥ 20, including ±∞.
double tanh(double x) noexcept;

/// Sine and cosine of x rad. Beyond 2³⁰ rad, x is reduced by the double nearest to 2π, with an error that grows with x.
/// ±∞ gives NaN.
double sin(double x) noexcept;
double cos(double x) noexcept;

/// Angle of (x, y) in rad, −π … π; 0 for (0, 0). The sign of zero is ignored. Both must be finite.
double atan2(double y, double x) noexcept;

/// √(a² + b²) without intermediate overflow or underflow.
template <class Scalar>
Scalar hypot(Scalar a, Scalar b) noexcept {
  const Scalar x = std::abs(a);
  const Scalar y = std::abs(b);
  const Scalar longer = x > y ? x : y;
  const Scalar shorter = x > y ? y : x;
  if (!(longer > 0) || !std::isfinite(longer)) return longer + shorter;  // 0, ∞ or NaN
  const Scalar ratio = shorter / longer;
  return longer * std::sqrt(1 + ratio * ratio);
}

}  // namespace tendon::portable
