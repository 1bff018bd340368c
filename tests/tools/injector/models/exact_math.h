// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/portable_math.h"

/// Distributions that give the same bits with every compiler and C library, for building tables, not for decisions.
/// They use portable functions only, in a fixed order. Errors are a few 1e-16 relative, unless stated. Arguments
/// outside the stated range are a mistake of the caller.
namespace tendon::injector::exact {

using portable::exp;
using portable::log;
using portable::round;

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
