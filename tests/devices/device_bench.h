// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "devices/simulated/simulated_device.h"
#include "tests/support/dice.h"

namespace tendon {

/// The simulated clock starts at an odd time.
class Bench {
 public:
  explicit Bench(SimulatedDevice::Config config) : device_(std::move(config)) { device_.read(now_); }

  /// Returns the position of the encoder after the given interval.
  Vec3 wait(Duration interval) {
    now_ += interval;
    return device_.read(now_)->position;
  }

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

inline Vec3 random_vector(Dice& dice, double size) {
  return {dice.within(-size, size), dice.within(-size, size), dice.within(-size, size)};
}

}  // namespace tendon
