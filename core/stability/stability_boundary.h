// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/stability/sampled_spring.h"

namespace tendon {

/// The stability boundaries of a sampled spring on a free handle, for linear friction and exact positions. They ignore
/// Coulomb friction and the encoder step (see coulomb_boundary.h) and need a mass > 0.
///
/// Returns the spectral radius of one period of the closed loop. This is the magnitude of the largest eigenvalue of the
/// exact discretisation, where the previous position and the d forces in transit are additional states. The loop is
/// stable if this is below 1 and unstable above. The other boundaries are compared with it. Thread-safe: yes.
/// Realtime-safe: no.
double spectral_radius(const SampledSpring& spring);

/// Returns the K (N/m) at which the spectral radius reaches 1, with a relative error of 1e-9, or 0 if the virtual
/// damper is unstable even with the softest spring. Ignores the K of `spring`.
double largest_stable_stiffness(const SampledSpring& spring);

/// Returns the same in closed form for B = 0, d = 0, from the Jury criterion, with δ = e^{−bT/m}:
///     K_max = b (1 − δ)/( m (1 − δ)/b − T δ ) = 2b/T (1 + bT/(6m) + …)
/// Throws std::invalid_argument if B or d is not 0. Source: core/PROOFS.md, "Stability boundaries".
double jury_stiffness(const SampledSpring& spring);

struct LinearLaw {
  double stiffness = 0;  ///< (b + B)/(T/2 + dT), N/m
  /// |B| (T/2 + dT)/m. If this is less than 0.003, the error of the law is at most 1 %, compared with the eigenvalues.
  /// The law is 3 % too high at 0.013, and four times too high at 1.4 (75 g, 1 kHz, B ≤ 5 N·s/m, d ≤ 20). Without a
  /// damper, it is at most 1.5 %.
  double damper_share = 0;
};

/// Source: Gil et al., IEEE TCST 12(4), 2004, and Hulin et al. (recalled). The validity was measured.
LinearLaw gil_stiffness(const SampledSpring& spring);

}  // namespace tendon
