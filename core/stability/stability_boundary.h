// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/stability/sampled_spring.h"

namespace tendon {

/// Where a sampled spring on a free handle stops being stable, for linear friction and exact sensing: Coulomb friction
/// and encoder step are not looked at (coulomb_boundary.h does). All need a mass > 0.
///
/// Spectral radius of one period of the closed loop: the largest eigenvalue of the exact discretisation, augmented by
/// the previous position and the d forces under way. Below 1 stable, above 1 unstable. The oracle of the others.
/// Thread-safe: yes. Realtime-safe: no.
double spectral_radius(const SampledSpring& spring);

/// The K (N/m) at which the spectral radius reaches 1, relative error 1e-9; the K of `spring` is ignored. 0 when even
/// the softest spring is unstable, because the virtual damper is.
double largest_stable_stiffness(const SampledSpring& spring);

/// The same in closed form for B = 0, d = 0, from Jury's criterion, with δ = e^{−bT/m}:
///
///     K_max = b (1 − δ)/( m (1 − δ)/b − T δ ) = 2b/T (1 + bT/(6m) + …)
///
/// Throws std::invalid_argument for another B or d. Source: control.md 6.2 (derived).
double jury_stiffness(const SampledSpring& spring);

/// Gil's linear law and its validity.
struct LinearLaw {
  /// (b + B)/(T/2 + dT), N/m
  double stiffness = 0;
  /// |B| (T/2 + dT)/m. Against the eigenvalues the law is within 1 % below 0.003, 3 % too high at 0.013, and four times
  /// too high at 1.4 (75 g, 1 kHz, B ≤ 5 N·s/m, d ≤ 20). Zero without virtual damper: then within 1.5 %.
  double damper_share = 0;
};

/// Source: Gil et al., IEEE TCST 12(4), 2004, and Hulin et al. (recalled; its validity measured, control.md 6.3).
LinearLaw gil_stiffness(const SampledSpring& spring);

}  // namespace tendon
