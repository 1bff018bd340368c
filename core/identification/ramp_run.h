// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace tendon {

/// One sample of a run along the single free axis. For a rotation of the handle the units are rad, N·m and kg·m², here
/// and in everything that is derived from it.
struct RampSample {
  double t = 0;         ///< s
  double position = 0;  ///< m, encoder reading at t
  double force = 0;     ///< N, the force of the device on the handle along +x, which is held from t to the next sample
};

/// One run of the friction experiment on a free handle. The other axes are constrained and gravity is compensated. The
/// force increases from zero at a constant rate until the handle breaks away and slides through its workspace.
struct RampRun {
  std::string place;  ///< axis and pose as text; runs of the same place are compared
  std::vector<RampSample> samples;
};

/// The part of a run in which the handle slides, mirrored if necessary so that it slides along +x. It begins more than
/// 5 counts away from the start of the run, because the handle can bend before it slides. It ends 5 counts and 2
/// samples before the farthest point, so that the stop at the end of the workspace is not included. A median of 5
/// samples removes outliers.
struct Slide {
  std::vector<RampSample> samples;
  double direction = 0;  ///< +1 or −1, the direction of the motion in the coordinates of the run
};

/// Throws std::invalid_argument if a value is not finite, if time does not increase, or if the handle moves less than
/// 50 counts (`encoder_step`, m, ≥ 0), slides back by more than 5 counts, pushes against the force, or slides for fewer
/// than 50 samples. The message contains the cause and the index of the sample, counted from 0.
Slide slide_of(const RampRun& run, double encoder_step);

/// The least-squares line rate · (t − start) of the force of a slide.
struct Ramp {
  double rate = 0;   ///< s, N/s
  double start = 0;  ///< s, zero of the line
};

/// Throws std::invalid_argument if the force does not rise, or deviates from the line by more than 2 % of its rise.
Ramp ramp_of(const Slide& slide);

}  // namespace tendon
