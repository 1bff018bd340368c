// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "core/stability/sampled_spring.h"

namespace tendon {

/// Boundaries of a sampled spring with Coulomb friction and an encoder. Laws without virtual damper: B ≠ 0 throws.
///
/// The largest K (N/m) at which a held count can be paid for by friction: min(2b/T, 2 f_c/Δ); 2b/T with Δ = 0.
/// Throws for d ≠ 0, for which the law does not hold. Source: Abbott and Okamura, IEEE T-RO 21(5):952, 2005.
/// Thread-safe: yes. Realtime-safe: no.
double abbott_okamura_stiffness(const SampledSpring& spring);

/// The behaviour of a sampled spring, by Diolaiti's three numbers.
enum class DiolaitiRegion {
  kPassive,          ///< comes to rest, from any speed
  kLimitCycle,       ///< slows down, but about one count of motion may remain
  kLocallyStable,    ///< comes to rest when slower than `speed_limit`, grows when faster
  kLocalLimitCycle,  ///< both: about one count of motion may remain, grows when faster than `speed_limit`
};

std::string_view to_string(DiolaitiRegion region) noexcept;

struct Diolaiti {
  double beta = 0;   ///< b/(KT); infinite for K = 0
  double sigma = 0;  ///< f_c/(KΔ); infinite for K = 0 or Δ = 0
  double tau = 0;    ///< delay in periods: d
  DiolaitiRegion region = DiolaitiRegion::kPassive;
  /// m/s; infinite where β ≥ ½ + τ:
  ///     v_lim = (4/π) f_c/(K (T/2 + dT) − b)
  /// the speed amplitude of the limit cycle that its describing function predicts, for slow oscillations (KT² ≪ m).
  /// Simulated, it decays at 0.94 and grows at 1.18 of it.
  double speed_limit = 0;
};

/// The numbers and the region:  β ≥ ½ + τ: from any speed;  σ ≥ ½: to rest.
/// Source: Diolaiti et al., IEEE T-RO 22(2), 2006; the σ part is Abbott and Okamura's, v_lim is derived
/// (control.md 6.5).
Diolaiti diolaiti(const SampledSpring& spring);

}  // namespace tendon
