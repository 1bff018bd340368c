// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// A virtual spring and damper on a real handle, for which the literature has closed-form boundaries. For the handle,
///     m dv/dt = F − b v − f_c sgn(v),
///     F(t) = −[ K x(k−d) + B (x(k−d) − x(k−d−1))/T ]    for kT ≤ t < (k+1)T        (N, on the hand)
/// where x(k) is the position at kT, rounded to the encoder step. There is no hand and no unilateral contact.
///
/// All functions of core/stability take this struct. They throw std::invalid_argument with the field, its value and the
/// expected range, even for a field that they do not use. They are not realtime-safe.
struct SampledSpring {
  double mass = 0;          ///< m, kg
  double viscous = 0;       ///< b, N·s/m, the friction of the device
  double coulomb = 0;       ///< f_c, N, the friction of the device
  double stiffness = 0;     ///< K, N/m, virtual
  double damping = 0;       ///< B, N·s/m, virtual, on the backward difference of the position
  Duration period{};        ///< T, > 0
  int delay_samples = 0;    ///< d, 0 … kMaxDelaySamples
  double encoder_step = 0;  ///< Δ, m, one count; 0 = exact
};

/// Limits the size of the eigenvalue problem. The laws are not useful if the delay is longer.
inline constexpr int kMaxDelaySamples = 200;

/// Returns the mean age of the held force, T/2 + d T, in s. Most boundaries compare friction with stiffness × this age.
double mean_age(const SampledSpring& spring);

/// Throws if a field is not finite, if a field other than B is negative, if T = 0, or if d > kMaxDelaySamples.
void check(const SampledSpring& spring);

/// For laws without a virtual damper. Throws if B ≠ 0.
void check_without_damper(const SampledSpring& spring);

}  // namespace tendon
