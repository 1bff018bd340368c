// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/portable_math.h"

/// Distribution functions with bit-identical results on every compiler and C library, for building tables. They use
/// portable functions in a fixed order. Relative errors are a few 1e-16 unless stated. The behavior is undefined for
/// arguments outside the stated range.
namespace tendon::injector::exact {

using portable::exp;
using portable::log;
using portable::round;

/// Φ⁻¹(p), the standard normal quantile, for p in (0, 1). Wichura, "Algorithm AS 241: the percentage points of the
/// normal distribution", Applied Statistics 37 (1988).
double normal_quantile(double p) noexcept;

/// 1 − Φ(z) for z in 0…37. Relative error below 1e-13.
double normal_tail(double z) noexcept;

/// Quantile of a gamma distribution with this shape and scale 1, for the probability p below and q = 1 − p above. The
/// smaller of the two carries the precision. Shape in 1e-3…1e6. Relative error below 1e-9. Returns 0 for results below
/// 1e-300.
double gamma_quantile(double shape, double p, double q) noexcept;

}  // namespace tendon::injector::exact
