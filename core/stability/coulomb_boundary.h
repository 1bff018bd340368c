// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "core/stability/sampled_spring.h"

namespace tendon {

/// The boundaries of a sampled spring with Coulomb friction and an encoder, without a virtual damper. B ≠ 0 throws.
///
/// Returns the largest K (N/m) at which friction dissipates the energy of a count: min(2b/T, 2 f_c/Δ), or 2b/T if Δ is
/// 0. Throws if d ≠ 0. Source: Abbott and Okamura, IEEE T-RO 21(5):952, 2005. Thread-safe: yes. Realtime-safe: no.
double abbott_okamura_stiffness(const SampledSpring& spring);

enum class DiolaitiRegion {
  kPassive,          ///< always comes to rest
  kLimitCycle,       ///< slows down, but about one count of motion can remain
  kLocallyStable,    ///< similar to kPassive below `speed_limit`, but unstable above this speed
  kLocalLimitCycle,  ///< similar to kLimitCycle below `speed_limit`, but unstable above this speed
};

std::string_view to_string(DiolaitiRegion region) noexcept;

struct Diolaiti {
  double beta = 0;   ///< b/(KT); infinite for K = 0
  double sigma = 0;  ///< f_c/(KΔ); infinite for K = 0 or Δ = 0
  double tau = 0;    ///< delay in periods: d
  DiolaitiRegion region = DiolaitiRegion::kPassive;
  /// m/s, v_lim = (4/π) f_c/(K (T/2 + dT) − b), or infinite if β ≥ ½ + τ. This is the velocity amplitude of the limit
  /// cycle according to its describing function, for KT² ≪ m. Simulated motion decays at 0.94 v_lim and grows at 1.18
  /// v_lim.
  double speed_limit = 0;
};

/// If β ≥ ½ + τ, the motion is slowed down at any speed. If σ ≥ ½, it comes to rest. Source: Diolaiti et al., IEEE T-RO
/// 22(2), 2006; σ as in Abbott and Okamura; v_lim: core/PROOFS.md, "Stability boundaries".
Diolaiti diolaiti(const SampledSpring& spring);

}  // namespace tendon
