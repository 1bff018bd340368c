// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/identification/ramp_run.h"
#include "devices/simulated/simulated_device.h"

namespace tendon::lab {

/// The friction experiment of the paper (Tables II, III) on a simulated device: from rest, a force that rises from zero
/// at a constant rate, until the handle has travelled through its workspace.
struct RampExperiment {
  SimulatedDevice::Config device;                ///< without a hand
  std::vector<double> rates = {0.05, 0.1, 0.5};  ///< N/s, each > 0; every one is run in both directions
  int repeats = 5;                               ///< of each rate and direction
  double travel = 0.25;                          ///< m
  double force_noise = 0.005;                    ///< N, standard deviation, of the motors: unknown to whoever evaluates
  double bias = 0;                               ///< N, constant force along +x that nobody knows of: gravity, say
  Duration period = std::chrono::milliseconds(1);
  Duration longest = std::chrono::seconds(20);  ///< of one run
  std::uint64_t seed = 1;
};

/// The runs, along x, recorded as a program beside the device would: encoder positions and the force it commanded.
/// Repeatable from the seed. Throws std::invalid_argument for what SimulatedDevice refuses, and for a rate or travel
/// that is not positive.
std::vector<RampRun> simulated_ramps(const RampExperiment& experiment);

}  // namespace tendon::lab
