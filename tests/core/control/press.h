// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "core/control/stability_controller.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

struct Press {
  double stiffness = 0;   ///< N/m, displayed: mean force / mean depth in the last 0.3 s
  double unrest = 0;      ///< m/s rms, velocity in the last 0.5 s
  double peak_force = 0;  ///< N
  double least_work = 0;  ///< J, minimum of the hand's work plus the initial kinetic energy
};

/// All laws use the same parameters. Device 75 g, hand 50 g with 400 N/m and 0.3 N·s/m, b = 0.26 N·s/m, f_c = 0.02 N, 1
/// kHz. The hand starts 20 mm in front of the wall, and its target is 10 mm inside. The device saturates at 60 N.
template <class Law>
requires StabilityController<Law, 1> Press press(Law law, double wall) {
  using std::chrono::milliseconds;
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.viscous_friction = 0.26;
  config.coulomb_friction = 0.02;
  config.max_force = 60;
  config.hand = OperatorHand::Config{
      400, 0.3, 0.05, ScriptedMotion(ScriptedMotion::RampHold{{-0.02, 0, 0}, {0.01, 0, 0}, milliseconds(500), {}})};
  SimulatedDevice device(config);
  Press result;
  Vec3 applied = Vec3::Zero();
  double x = 0;
  double forces = 0;
  double depths = 0;
  double squares = 0;
  for (int step = 0; step < 3000; ++step) {
    const double now = device.read(LocalTime(milliseconds(step)))->position.x();
    if (step > 0) law.observe({Vec<1>(applied.x()), Vec<1>(now - x), milliseconds(1)});
    x = now;
    const Demand<1> demand = x > 0 ? Demand<1>{Vec<1>(-wall * x), Mat<1>(wall)} : Demand<1>{Vec<1>(0.0), Mat<1>(0.0)};
    applied = device.apply(Vec3(law.limit(demand).force[0], 0, 0));
    result.peak_force = std::max(result.peak_force, std::abs(applied.x()));
    result.least_work = std::min(result.least_work, device.truth().hand_work);
    if (step >= 2700) {
      forces -= applied.x();
      depths += x;
    }
    if (step >= 2500) squares += device.truth().velocity.squaredNorm();
  }
  result.stiffness = forces / depths;
  result.unrest = std::sqrt(squares / 500);
  return result;
}

inline constexpr Friction kPressFriction{0.02, 0.26};

}  // namespace tendon
