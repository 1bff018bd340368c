// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Functions of doubles that give the same bits with every compiler and C library. libm may differ in the last bit from
/// one version to the next; these use only + − · ÷ and √, which IEEE 754 rounds correctly, in a fixed order. Compile
/// with -ffp-contract=off: a fused multiply-add would round once less.
///
/// They are for building tables, not for decisions. Errors are a few 1e-16 relative, unless stated. Arguments outside
/// the stated range are a mistake of the caller.
namespace tendon::injector::exact {

/// The nearest whole number, halves away from zero; |x| below 2⁶².
std::int64_t round(double x) noexcept;

/// Natural logarithm; x above zero, normal and finite.
double log(double x) noexcept;

/// eˣ for x in −700…700.
double exp(double x) noexcept;

/// Φ⁻¹(p): the standard normal deviation below which the share p lies; p in (0, 1). Wichura, "Algorithm AS 241: the
/// percentage points of the normal distribution", Applied Statistics 37 (1988).
double normal_quantile(double p) noexcept;

/// 1 − Φ(z) for z in 0…37: the share above z. Relative error below 1e-13.
double normal_tail(double z) noexcept;

/// The x of which the share p of a gamma distribution with this shape (and scale 1) lies below, and the share q = 1 − p
/// above; both are passed, because the smaller one carries the precision. Shape in 1e-3…1e6. Relative error below 1e-9.
/// Below 1e-300 it is 0.
double gamma_quantile(double shape, double p, double q) noexcept;

}  // namespace tendon::injector::exact
