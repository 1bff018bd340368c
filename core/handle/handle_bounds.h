// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include "core/ledger/friction.h"

namespace tendon {

/// Limits that no real handle exceeds. A value beyond a limit is refused, because it is almost always in the wrong unit
/// (ms instead of s, mm instead of m, g instead of kg). The margin is large: known arms have a reach of 1.5 m, and
/// admittance devices 20 N·s/m of friction and 10 kg. For a rotation, m, kg and N become rad, kg·m² and N·m.
struct HandleBounds {
  double travel = 0;         ///< m, from end to end
  double least_inertia = 0;  ///< kg
  double most_inertia = 0;   ///< kg
  Friction friction;         ///< N, N·s/m
  double encoder_step = 0;   ///< m
};

inline constexpr HandleBounds kMovementBounds = {.travel = 3,
                                                 .least_inertia = 1e-3,
                                                 .most_inertia = 20,
                                                 .friction = {.coulomb = 20, .viscous = 50},
                                                 .encoder_step = 1e-3};
inline constexpr HandleBounds kRotationBounds = {.travel = 4 * std::numbers::pi,
                                                 .least_inertia = 1e-7,
                                                 .most_inertia = 1,
                                                 .friction = {.coulomb = 2, .viscous = 0.5},
                                                 .encoder_step = 0.02};

}  // namespace tendon
