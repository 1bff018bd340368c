// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/experiments/pressed_block.h"
#include "tests/tools/lab/experiments/pressed_engine.h"

namespace tendon::lab {

/// Quality at the hand: the whole loop with AOL+ in virtual time. The body is the engine behind a network, with its
/// measured update time as period; a dynamic body steps at that rate. Compared with the truth of the same block.
struct Felt {
  double displayed = 0;      ///< Σ F·d / Σ F_true·d over depths d: displayed fraction of the true stiffness
  double force_error = 0;    ///< the rms of the error divided by the rms of the true force
  double held_error = 0;     ///< the same value if the forces are held
  double limited_share = 0;  ///< the fraction of the periods in which the limiter changes the force
  double vibration = 0;      ///< m/s, the vibration of a free hand in the last second
  double latency = 0;        ///< s, the delay of the felt force
};

/// A hand presses in and releases 0.8 times per second, slightly irregularly, for 3 s, at most as deep as under the
/// larger load. The device has a damping of 0.26 N·s/m and a rate of 1 kHz. `engine` must have the block of `truth`.
/// Throws TooSlow after `longest_s` (PressedEngine::took), because Newton's method is slow for a collapsing body.
Felt felt(PressedEngine& engine, Truth& truth, const Route& route, std::uint64_t seed,
          double longest_s = std::numeric_limits<double>::infinity());

}  // namespace tendon::lab
