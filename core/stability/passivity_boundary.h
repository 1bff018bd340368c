// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <functional>

#include "core/stability/sampled_spring.h"

namespace tendon {

/// How much viscous friction makes a sampled environment passive: then nothing that the hand does, and no passive
/// hand, draws energy out of it. Stronger than stability (stability_boundary.h), and independent of the mass.
///
/// The least b (N·s/m) for which the spring and damper are passive, Colgate and Schenkel's condition with delay:
///
///     b = max over 0 ≤ θ ≤ π of  (KT/2) sin((d+½)θ)/sin(θ/2) − B cos((d+1)θ),      θ = ωT
///
/// Without delay this is KT/2 + |B|; without damper it is K (T/2 + dT). Uses K, B, T, d.
/// Source: J. Robotic Systems 14(1), 1997; with delay: derived and checked numerically (control.md 6.1).
/// Thread-safe: yes. Realtime-safe: no.
double passive_viscous_friction(const SampledSpring& spring);

/// The same for any linear environment, F(z) = −H(z) x(z) on the hand, by its transfer function at z = e^{jθ}:
///
///     b = max over 0 < θ ≤ π of  (T/2)/(1 − cos θ) · Re{(1 − e^{−jθ}) H(e^{jθ})}
///
/// on a uniform grid of `points` angles: as good as the grid is fine. Throws std::invalid_argument for T ≤ 0, for
/// fewer than 2 points, and when H is not finite somewhere.
double passive_viscous_friction(const std::function<std::complex<double>(std::complex<double> z)>& environment,
                                Duration period, int points = 10'000);

/// The largest K (N/m) that is passive with the b, B, T and d of `spring`, whose own K is ignored; 0 when B alone is
/// too large. Without damper: b/(T/2 + dT). Never infinite, because b is finite.
double largest_passive_stiffness(const SampledSpring& spring);

/// The least b (N·s/m) for which any force field, linear or not, is passive when its slope nowhere leaves
/// 0 … `steepest` (N/m), T and d as in `spring`:
///
///     b = K_max (T/2 + dT)
///
/// Source: Mahvash and Hayward, IEEE T-RO 21(1), 2005 (recalled; derived and tested in control.md 5.6). Also the
/// usable special case of Miller, Colgate and Freeman, IEEE T-RA 16(6), 2000, with K_max that of the virtual coupling.
double passive_viscous_friction_of_field(double steepest, Duration period, int delay_samples);

/// The stiffness felt of an environment K (N/m) behind a virtual coupling K_c, two springs in series: K_c K/(K_c + K).
/// The device touches only the coupling, so the coupling has to meet the conditions above.
/// Source: Colgate, Stanley and Brown, IROS 1995 (recalled; control.md 5.4).
double felt_stiffness(double coupling, double environment);

}  // namespace tendon
