// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/identification/ramp_run.h"
#include "core/ledger/friction.h"

namespace tendon {

/// The paper's own way to friction: under a force that rises as s·t the speed approaches a straight line, whose slope μ
/// and intersection t_i with the time axis give
///
///     (12)  b   = s/μ                  N·s/m
///     (11)  f_c = s t_i − m μ          N
///
/// The line is fitted to the last 40 % of the slide, as the parabola of the position: nothing is differentiated.
///
/// **It is only an asymptote**, valid some m/b after break-away. Until then the handle just accelerates, μ is too
/// small, and b comes out too large: in 0.25 m of travel 0.005 N·s/m is seen as 0.07 to 0.25. `long_enough` and a
/// positive f_c are what one run can say about that; that two slopes agree takes two (friction_identification.h).
///
/// Source: Kelly, Llamas and Campa, IEEE TIM 49(4), 2000 (recalled); eqs (11), (12) of Lee & Lee 2009, derived in
/// control.md 2.
struct KellyFit {
  Friction friction;         ///< not a lower bound; may be negative
  double rate = 0;           ///< s, N/s
  double slide_time = 0;     ///< s, from break-away to the end of the slide
  double time_constant = 0;  ///< m/b with the b found, s; infinite when b is not positive

  bool long_enough() const noexcept { return slide_time >= 4 * time_constant; }
  bool plausible() const noexcept { return long_enough() && friction.coulomb > 0; }
};

/// `mass`: kg, > 0. Throws std::invalid_argument for a mass that is not, and as `ramp_of`.
/// Thread-safe: yes. Realtime-safe: no.
KellyFit kelly_fit(const Slide& slide, double mass);

}  // namespace tendon
