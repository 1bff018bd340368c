// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// A virtual spring and damper on a real handle, sampled and held: the one system for which the literature has
/// closed-form boundaries. Everything in core/stability is a function of it. On the handle,
///
///     m dv/dt = F − b v − f_c sgn(v),
///     F(t) = −[ K x(k−d) + B (x(k−d) − x(k−d−1))/T ]    for kT ≤ t < (k+1)T        (N, on the hand)
///
/// with x(k) the position at kT rounded to the encoder step. No hand, no unilateral contact.
///
/// Every function that takes one throws std::invalid_argument naming the field, its value and what was expected,
/// even when a field is set that its law does not use. None is for the haptic loop.
struct SampledSpring {
  double mass = 0;          ///< m, kg
  double viscous = 0;       ///< b, N·s/m, of the device
  double coulomb = 0;       ///< f_c, N, of the device
  double stiffness = 0;     ///< K, N/m, virtual
  double damping = 0;       ///< B, N·s/m, virtual, on the backward difference of the position
  Duration period{};        ///< T, > 0
  int delay_samples = 0;    ///< d, 0 … kMaxDelaySamples
  double encoder_step = 0;  ///< Δ, m, one count; 0 = exact
};

/// Far beyond any loop in which these laws mean something; bounds the size of an eigenvalue problem.
inline constexpr int kMaxDelaySamples = 200;

/// The age of the force in the middle of the interval in which it is held: T/2 + d T, s. Most boundaries are
/// "friction against stiffness × this".
double mean_age(const SampledSpring& spring);

/// Throws as described above unless all fields are finite, mass and the rest not negative (only B may be), T > 0 and
/// 0 ≤ d ≤ kMaxDelaySamples. The laws call it themselves.
void check(const SampledSpring& spring);

/// Throws unless B = 0: for laws that know no virtual damper.
void check_without_damper(const SampledSpring& spring);

}  // namespace tendon
