// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "devices/device.h"
#include "devices/safety/safe_device.h"

namespace tendon {

/// Runs a driver one haptic period at a time. `Bench` adds `device`, `step(force)`, which calls `drive` and `look`, and
/// `home(force)`, which homes the device as a user would.
template <class Bench>
struct DriverBench {
  void drive(Device& device, const Vec3& force) {
    sample = device.read(now);
    written = device.apply(force);
  }

  void look(bool pushes, bool lawful) {
    lawless = pushes && !lawful ? lawless + 1 : 0;
    most_lawless = std::max(most_lawless, lawless);
    after_zero = pushes ? 0 : after_zero + 1;
  }

  void run(Duration time, const Vec3& force = Vec3::Zero()) {
    for (const LocalTime end = now + time; now < end;) bench().step(force);
  }

  /// Homes the device if it is not homed. Returns false if this takes longer than `most`.
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
  int lawless = 0;  ///< consecutive periods in which the device pushed without an origin
  int most_lawless = 0;
  int after_zero = 0;  ///< consecutive periods without force

 private:
  Bench& bench() { return static_cast<Bench&>(*this); }
};

/// A device with a safety layer must only be driven while it is armed. After it was unplugged, it must be possible to
/// home it and to arm it again. `home` is called to home the device, and `advance` to step the model to `now`.
template <class Bench, class Model, class Home, class Advance>
void expect_homing_and_arming_after_a_replug(Bench& bench, Model& model, Home home, Advance advance) {
  using std::chrono::milliseconds;
  const Vec3 force(1, -2, 2);
  SafeDevice safe({}, bench.device);
  const auto run = [&](Duration time, const Vec3& asked) {
    for (const LocalTime end = bench.now + time; bench.now < end;) {
      advance(bench.now += milliseconds(1));
      safe.read(bench.now);
      safe.apply(asked);
      ASSERT_TRUE(!model.pushes() || safe.status().state == SafetyState::kArmed);
    }
  };
  for (int plugged = 0; plugged < 2; ++plugged) {
    run(milliseconds(2000), Vec3::Zero());
    ASSERT_EQ(safe.state(), Device::State::kUnhomed);
    safe.arm();
    run(milliseconds(200), Vec3::Zero());
    EXPECT_NE(safe.status().state, SafetyState::kArmed) << "not homed";
    home();
    run(milliseconds(2000), force);
    EXPECT_EQ(safe.state(), Device::State::kHomed);
    EXPECT_FALSE(model.pushes()) << "homed, and not armed";
    safe.arm();
    run(milliseconds(200), Vec3::Zero());
    ASSERT_EQ(safe.status().state, SafetyState::kArmed);
    run(milliseconds(200), force);
    EXPECT_TRUE(model.pushes());
    model.unplug();
    model.plug();
    run(milliseconds(1), force);
    EXPECT_EQ(safe.status().state, SafetyState::kFault);
    EXPECT_EQ(safe.status().last_fault, SafetyFault::kDeviceLost);
  }
}

}  // namespace tendon
