// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/experiments/pressed_block.h"
#include "tests/tools/lab/experiments/pressed_engine.h"

namespace tendon::lab {

/// What is left of a body at the hand: the whole loop with AOL+ in counted time, the body as the engine behind a
/// network, its measured time for an update as its period; a body with time takes its steps as quickly as that. All
/// against the truth of the same block.
struct Felt {
  double displayed = 0;      ///< Σ F·d / Σ F_true·d over depths d: the share of the true stiffness that is shown
  double force_error = 0;    ///< rms of force less true force, over that of the true force
  double held_error = 0;     ///< the same when no stiffness is sent along and forces are held
  double limited_share = 0;  ///< of the periods: the limiter changed what was wanted
  double vibration = 0;      ///< m/s, of a hand that is free to move, in its last second
  double latency = 0;        ///< s, by which what is felt follows what is true
};

/// A hand that presses in and comes off again 0.8 times a second, not quite evenly, for 3 s, as deep as the hard load
/// goes at the most; device of 0.26 N·s/m at 1 kHz. `engine` has the block of `truth`.
/// Throws TooSlow after `longest_s` (PressedEngine::took): Newton's method takes long over a body that collapses.
Felt felt(PressedEngine& engine, Truth& truth, const Route& route, std::uint64_t seed,
          double longest_s = std::numeric_limits<double>::infinity());

}  // namespace tendon::lab
