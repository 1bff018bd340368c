// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

/// Functions of doubles that give the same bits on every processor, with every compiler and every C library.
///
/// libm does not: glibc takes other instructions on a processor with FMA, and each version of it may round the last bit
/// otherwise. A law that calls it decides otherwise on another machine, and a simulation with an encoder magnifies that
/// last bit to another run. These use only + − · ÷ √, whole-number rounding and std::fmod, which are exact or which
/// IEEE 754 rounds correctly, in a fixed order. Compile with -ffp-contract=off (CMakeLists.txt does): a fused
/// multiply-add would round once less.
///
/// Errors are at most 2e-16 of the result and 1e-16 of 1, whichever is more, unless stated. NaN gives NaN where it is
/// accepted. Realtime-safe: yes.
namespace tendon::portable {

/// The nearest whole number, halves away from zero; |x| below 2⁶².
std::int64_t round(double x) noexcept;

/// Natural logarithm; x above zero, normal and finite. Anything else is a mistake of the caller.
double log(double x) noexcept;

/// eˣ. Relative error below 1e-15 for x in −700 … 700; 0 below −700, ∞ above 709.
double exp(double x) noexcept;

/// eˣ − 1, with full precision near zero too.
double expm1(double x) noexcept;

/// Between −1 and 1; ±1 from |x| = 20 on. tanh(±∞) = ±1.
double tanh(double x) noexcept;

/// Sine and cosine of x rad. Beyond 2³⁰ rad x is first reduced by the double nearest to 2π, whose error grows with x as
/// that of x itself. ±∞ gives NaN.
double sin(double x) noexcept;
double cos(double x) noexcept;

/// The angle of the point (x, y), rad, −π … π; of (0, 0) it is 0. The sign of a zero does not count. Both finite.
double atan2(double y, double x) noexcept;

/// √(a² + b²), without overflow or underflow on the way.
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
