// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

#include "devices/simulated/simulated_device.h"

namespace tendon {

/// A device on the test bench: a clock that starts at an odd instant, and one verb.
class Bench {
 public:
  explicit Bench(SimulatedDevice::Config config) : device_(std::move(config)) { device_.read(now_); }

  /// Moves time on by `interval` with the force that is held; returns what the encoder says then.
  Vec3 wait(Duration interval) {
    now_ += interval;
    return device_.read(now_)->position;
  }

  /// `apply`, then `wait`.
  Vec3 push(const Vec3& force, Duration interval) {
    device_.apply(force);
    return wait(interval);
  }

  SimulatedDevice& device() { return device_; }
  const SimulatedDevice::Truth& truth() const { return device_.truth(); }

 private:
  LocalTime now_{Duration(123'456'789)};
  SimulatedDevice device_;
};

/// Numbers from one seed, the same with every standard library.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  bool chance(double p) { return uniform(0, 1) < p; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace tendon
