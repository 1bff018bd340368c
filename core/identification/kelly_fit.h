// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/identification/ramp_run.h"
#include "core/ledger/friction.h"

namespace tendon {

/// The method of the paper. If the force increases as s·t, the speed approaches a line with slope μ and time intercept
/// t_i:
///     (12)  b   = s/μ                  N·s/m
///     (11)  f_c = s t_i − m μ          N
/// The fit uses the last 40 % of the slide. It fits a parabola to the positions, so it does not need a derivative.
///
/// **The line is only an asymptote.** It is valid some m/b after break-away. Before that, the handle still accelerates,
/// so μ is too small and b is too large: with 0.25 m of travel, 0.005 N·s/m is estimated as 0.07 to 0.25. A single run
/// can only be tested by `long_enough` and f_c > 0. Comparing slopes requires two runs (friction_identification.h).
///
/// Source: Kelly, Llamas and Campa, IEEE TIM 49(4), 2000 (recalled); eqs (11), (12) of Lee & Lee 2009; core/PROOFS.md,
/// "Friction identification".
struct KellyFit {
  Friction friction;         ///< not a lower bound, and can be negative
  double rate = 0;           ///< s, N/s
  double slide_time = 0;     ///< s, duration of the slide after break-away
  double time_constant = 0;  ///< m/b with the estimated b, s; infinite if b is not positive

  bool long_enough() const noexcept { return slide_time >= 4 * time_constant; }
  bool plausible() const noexcept { return long_enough() && friction.coulomb > 0; }
};

/// `mass`: kg. Throws std::invalid_argument if it is not > 0 or `ramp_of` throws. Thread-safe: yes. Realtime-safe: no.
KellyFit kelly_fit(const Slide& slide, double mass);

}  // namespace tendon
