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

/// Without a hand: from rest, the force along x rises from zero at a constant rate. For rotations and grippers a torque
/// about x or a grip force, in their units.
struct RampPlan {
  Freedom freedom = Freedom::kMovement;
  double rate = 0.1;     ///< N/s, nonzero; negative: towards −x
  double travel = 0.25;  ///< m, the maximum distance of the run
  Duration period = std::chrono::milliseconds(1);
  Duration longest = std::chrono::seconds(20);
  /// Returns an additional motor force (N) for each period; empty: none.
  std::function<double()> disturbance{};
};

/// Records the positions read and the force that the device reports, without the disturbance. The force stays constant
/// while readings fail. Ends with zero force.
RampRun run_ramp(Device& device, LocalTime begin, const RampPlan& plan);

/// The friction experiment of Lee & Lee 2009 (Tables II, III) on a simulated device: from rest, the force rises at a
/// constant rate until the handle has crossed its workspace.
struct RampExperiment {
  SimulatedDevice::Config device{};              ///< without a hand
  Freedom freedom = Freedom::kMovement;          ///< the following units are for a movement
  std::vector<double> rates = {0.05, 0.1, 0.5};  ///< N/s, must be positive. Each rate is used in both directions.
  int repeats = 5;                               ///< per rate and direction
  double travel = 0.25;                          ///< m
  double force_noise = 0.005;                    ///< N, standard deviation of the motor force; not recorded
  double bias = 0;                               ///< N, constant force along +x, such as gravity; not recorded
  Duration period = std::chrono::milliseconds(1);
  Duration longest = std::chrono::seconds(20);
  std::uint64_t seed = 1;
};

/// Along x. Deterministic in the seed. Throws std::invalid_argument if SimulatedDevice rejects its configuration or a
/// rate or the travel is not positive.
std::vector<RampRun> simulated_ramps(const RampExperiment& experiment);

}  // namespace tendon::lab
