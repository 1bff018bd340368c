// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/identification/ramp_run.h"
#include "devices/device.h"
#include "devices/simulated/simulated_device.h"
#include "tests/tools/lab/identify/freedom.h"

namespace tendon::lab {

/// One run of the friction experiment on a device that nobody touches: from rest, a force along x that rises from zero;
/// or a torque about x, or a force on the fingers, with their units.
struct RampPlan {
  Freedom freedom = Freedom::kMovement;
  double rate = 0.1;     ///< N/s, not 0; below 0: towards −x
  double travel = 0.25;  ///< m, after which it ends
  Duration period = std::chrono::milliseconds(1);
  Duration longest = std::chrono::seconds(20);
  /// N, what the motors do besides, each period; empty: nothing.
  std::function<double()> disturbance{};
};

/// Runs it, from `begin` on, and records what a program beside the device would: positions as they are read, and the
/// force that the device says it has written, but for the disturbance. While a reading does not come the force stays as
/// it is. Ends with zero force.
RampRun run_ramp(Device& device, LocalTime begin, const RampPlan& plan);

/// The friction experiment of the paper (Tables II, III) on a simulated device: from rest, a force that rises from zero
/// at a constant rate, until the handle has travelled through its workspace.
struct RampExperiment {
  SimulatedDevice::Config device{};              ///< without a hand
  Freedom freedom = Freedom::kMovement;          ///< the units below are those of a movement
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
