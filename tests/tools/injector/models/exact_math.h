// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/portable_math.h"

/// Distribution functions whose results are identical for all compilers and C libraries. Relative errors are a few
/// 1e-16 unless stated. Arguments outside the stated range are undefined behavior.
namespace tendon::injector::exact {

using portable::exp;
using portable::log;
using portable::round;

/// Φ⁻¹(p), the standard normal quantile, for p in (0, 1). Wichura, "Algorithm AS 241: the percentage points of the
/// normal distribution", Applied Statistics 37 (1988).
double normal_quantile(double p) noexcept;

/// 1 − Φ(z) for z in 0…37. Relative error below 1e-13.
double normal_tail(double z) noexcept;

/// Shape in 1e-3…1e6, scale 1, for the probability p below and q = 1 − p above; the smaller of the two carries the
/// precision. Relative error below 1e-9; 0 for results below 1e-300.
double gamma_quantile(double shape, double p, double q) noexcept;

}  // namespace tendon::injector::exact
