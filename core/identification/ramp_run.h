// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace tendon {

/// One sample of a run along the single free axis. If the handle is rotated, the units are rad, N·m and kg·m². This
/// also applies to all derived values.
struct RampSample {
  double t = 0;         ///< s
  double position = 0;  ///< m, encoder reading at t
  double force = 0;     ///< N, force of the device on the handle along +x, applied from t to the next sample
};

/// One run of the friction experiment on a free handle. The other axes are constrained and gravity is compensated. The
/// force increases from zero at a constant rate until the handle breaks away and slides through its workspace.
struct RampRun {
  std::string place;  ///< axis and pose as text, used to compare runs at the same place
  std::vector<RampSample> samples;
};

/// The part of a run in which the handle slides. If necessary, it is mirrored so that the handle slides along +x. The
/// first 5 counts of the motion are not included because the handle can bend before it slides. The last 5 counts and 2
/// samples before the farthest point are not included because of the stop. A median of 5 samples removes outliers.
struct Slide {
  std::vector<RampSample> samples;
  double direction = 0;  ///< direction of the motion in the coordinates of the run, +1 or −1
};

/// Throws std::invalid_argument if a value is not finite, if time does not increase, or if the handle moves less than
/// 50 counts (`encoder_step`, m, ≥ 0), slides back by more than 5 counts, pushes against the force, or slides for fewer
/// than 50 samples. The message contains the cause and the index of the sample, counted from 0.
Slide slide_of(const RampRun& run, double encoder_step);

/// The line rate · (t − start) that is fitted to the force of a slide (least squares).
struct Ramp {
  double rate = 0;   ///< s, N/s
  double start = 0;  ///< s, zero of the line
};

/// Throws std::invalid_argument if the force does not rise, or deviates from the line by more than 2 % of its rise.
Ramp ramp_of(const Slide& slide);

}  // namespace tendon
