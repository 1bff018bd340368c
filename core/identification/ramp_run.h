// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace tendon {

/// One sample of a run: along the one axis that is free to move. For a run that turns a handle read rad for m, N·m for N
/// and kg·m² for kg, here and in all that follows from it.
struct RampSample {
  double t = 0;         ///< s
  double position = 0;  ///< m, encoder reading at t
  double force = 0;     ///< N, of the device on the handle, along +x, held from t to the next sample
};

/// One run of the friction experiment: nobody touches the handle, the other axes are constrained, gravity is
/// compensated; the force rises from zero at a constant rate until the handle breaks away and runs through its
/// workspace.
struct RampRun {
  std::string place;  ///< axis and pose, as text; runs of the same place are compared with each other
  std::vector<RampSample> samples;
};

/// The part of a run in which the handle slides, turned so that it slides along +x.
///
/// It begins when the handle is more than 5 counts away from where it stood: before that it may have bent, not slid.
/// It ends 5 counts and 2 samples before the farthest point, so that standing at the end of the workspace is no part of
/// it. Both are decided on the median of 5 samples: a single wrong sample decides nothing.
struct Slide {
  std::vector<RampSample> samples;
  double direction = 0;  ///< +1 or −1: of the motion in the run's own coordinates
};

/// Throws std::invalid_argument when something is not finite, time does not increase, the handle does not move 50
/// counts (`encoder_step`, m, ≥ 0), slides back by more than 5, pushes against the force, or slides for fewer than 50
/// samples: the message says what and in which sample, counted from 0.
Slide slide_of(const RampRun& run, double encoder_step);

/// The force of a slide as the line rate · (t − start), by least squares.
struct Ramp {
  double rate = 0;   ///< s, N/s
  double start = 0;  ///< s, when the line is zero
};

/// Throws std::invalid_argument when the force does not rise, or is more than 2 % of its rise away from the line.
Ramp ramp_of(const Slide& slide);

}  // namespace tendon
