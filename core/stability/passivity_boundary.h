// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <functional>

#include "core/stability/sampled_spring.h"

namespace tendon {

/// Returns the smallest viscous friction b (N·s/m) for which the spring and damper are passive, which means that
/// neither a motion of the hand nor a passive hand can extract energy. This is stronger than stability
/// (stability_boundary.h) and independent of the mass. The condition of Colgate and Schenkel with delay is:
///     b = max over 0 ≤ θ ≤ π of  (KT/2) sin((d+½)θ)/sin(θ/2) − B cos((d+1)θ),      θ = ωT
/// Without delay this is KT/2 + |B|, and without a damper K (T/2 + dT). Uses K, B, T, d. Source: J. Robotic Systems
/// 14(1), 1997; with delay: core/PROOFS.md, "Stability boundaries". Thread-safe: yes. Realtime-safe: no.
double passive_viscous_friction(const SampledSpring& spring);

/// Returns the same for any linear environment F(z) = −H(z) x(z) (on the hand), by its transfer function at z = e^{jθ}:
///     b = max over 0 < θ ≤ π of  (T/2)/(1 − cos θ) · Re{(1 − e^{−jθ}) H(e^{jθ})}
/// The maximum is taken over a uniform grid of `points` angles, which limits its accuracy. Throws std::invalid_argument
/// if T ≤ 0, if there are fewer than 2 points, or if H is not finite at a point.
double passive_viscous_friction(const std::function<std::complex<double>(std::complex<double> z)>& environment,
                                Duration period, int points = 10'000);

/// Returns the largest K (N/m) that is passive with the b, B, T and d of `spring`, or 0 if B alone is too large.
/// Ignores its K. The result is b/(T/2 + dT) without a damper, and always finite.
double largest_passive_stiffness(const SampledSpring& spring);

/// Returns the smallest b (N·s/m) for which any force field with slopes in [0, `steepest`] (N/m) is passive:
///     b = K_max (T/2 + dT)
///
/// Source: Mahvash and Hayward, IEEE T-RO 21(1), 2005 (recalled); core/PROOFS.md, "Comparison laws". It is also a
/// special case of Miller, Colgate and Freeman, IEEE T-RA 16(6), 2000, with the K_max of the virtual coupling.
double passive_viscous_friction_of_field(double steepest, Duration period, int delay_samples);

/// Returns the stiffness that the hand feels for K (N/m) behind a virtual coupling K_c: K_c K/(K_c + K). The coupling
/// must satisfy the conditions above, because it is the only part that the device is in contact with. Source: Colgate,
/// Stanley and Brown, IROS 1995 (recalled).
double felt_stiffness(double coupling, double environment);

}  // namespace tendon
