// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

inline constexpr double kWallStiffness = 2000;  // N/m, at x = 0

inline Physics wall() {
  return
      [](const DeviceState& hand) -> Touch { return Vec3(-kWallStiffness * std::max(0.0, hand.position.x()), 0, 0); };
}

inline ForceClient::Config at_100_hz() {
  ForceClient::Config config;
  config.name = "Z";
  config.rate_hz = 100;
  return config;
}

/// A falcon that a hand moves from x = -10 mm.
inline SimulatedDevice::Config moved_falcon(const Vec3& to, Duration ramp, std::optional<Duration> hold) {
  SimulatedDevice::Config device = find_device_profile("falcon")->device();
  device.hand = OperatorHand::Config{.stiffness = 300,
                                     .damping = 3,
                                     .mass = 0.05,
                                     .motion = ScriptedMotion(ScriptedMotion::RampHold{
                                         .from = Vec3(-0.01, 0, 0), .to = to, .ramp = ramp, .hold = hold})};
  return device;
}

inline constexpr Friction kBounds = {.coulomb = 0.3, .viscous = 0.8};  // below the falcon's true friction

inline World::Config world_config(const DeviceInfo& device, std::uint64_t seed = 7) {
  World::Config config;
  config.seed = seed;
  config.loop.control.limiter.friction = kBounds;
  config.loop.control.limiter.longest_hold = std::chrono::milliseconds(2);
  config.loop.control.max_force = device.max_force;
  config.loop.control.max_slew = 1000;
  return config;
}

struct Log {
  explicit Log(World& world) {
    world.watch_steps([this](const StepRecord& step) { steps.push_back(step); });
  }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  double peak() const {
    double peak = 0;
    for (const StepRecord& step : steps) peak = std::max(peak, step.applied.norm());
    return peak;
  }
  double least_energy() const {
    double least = 0;
    for (const StepRecord& step : steps) least = std::min(least, step.energy);
    return least;
  }
  bool has(Reason reason) const {
    return std::ranges::any_of(steps, [=](const StepRecord& step) { return step.reasons.has(reason); });
  }
  double largest_rise() const {
    double largest = 0;
    for (std::size_t i = 1; i < steps.size(); ++i) {
      largest = std::max(largest, steps[i].applied.norm() - steps[i - 1].applied.norm());
    }
    return largest;
  }
  std::vector<Mode> modes() const {
    std::vector<Mode> seen;
    for (const StepRecord& step : steps) {
      if (seen.empty() || seen.back() != step.mode) seen.push_back(step.mode);
    }
    return seen;
  }

  std::vector<StepRecord> steps;
};

}  // namespace tendon::simulation
