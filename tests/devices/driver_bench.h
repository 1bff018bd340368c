// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "devices/device.h"

namespace tendon {

/// A driver, a cable and a model of its device: one turn of the haptic loop after the other, in simulated time. `Bench`
/// adds `device`, `step(force)`, which calls `drive` and `look`, and `home(force)`: what a user does to home the
/// device.
template <class Bench>
struct DriverBench {
  /// The driver's part of a turn.
  void drive(Device& device, const Vec3& force) {
    sample = device.read(now);
    written = device.apply(force);
  }

  /// An onlooker's: whether the device pushes, and whether it may.
  void look(bool pushes, bool lawful) {
    lawless = pushes && !lawful ? lawless + 1 : 0;
    most_lawless = std::max(most_lawless, lawless);
    after_zero = pushes ? 0 : after_zero + 1;
  }

  void run(Duration time, const Vec3& force = Vec3::Zero()) {
    for (const LocalTime end = now + time; now < end;) bench().step(force);
  }

  /// Whether it comes to `state`; homes where that is the way.
  bool reaches(Device::State state, Duration most, const Vec3& force = Vec3::Zero()) {
    for (const LocalTime end = now + most; now < end && bench().device.state() != state;) {
      bench().step(force);
      if (state == Device::State::kHomed && bench().device.state() == Device::State::kUnhomed) bench().home(force);
    }
    return bench().device.state() == state;
  }

  LocalTime now{};
  std::optional<PositionSample> sample;
  Vec3 written = Vec3::Zero();
  int lawless = 0;  ///< turns in a row in which the device pushed although it has no origin
  int most_lawless = 0;
  int after_zero = 0;  ///< turns in a row in which it did not push

 private:
  Bench& bench() { return static_cast<Bench&>(*this); }
};

}  // namespace tendon
