// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "devices/safety/safe_device.h"

namespace tendon {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Puppet final : Device {
  DeviceInfo about{.name = "puppet", .max_force = 10, .position_resolution = 50e-6, .watchdog = {}};
  State stage = State::kHomed;
  Vec3 position = Vec3::Zero();
  std::uint32_t buttons = 0;
  bool answers = true;
  Duration age{};  ///< age of the samples
  std::optional<Quat> orientation{};
  std::optional<double> opening{};
  Vec3 told = Vec3::Constant(kNaN);
  Effort told_all{};

  const DeviceInfo& info() const noexcept override { return about; }
  State state() const noexcept override { return stage; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    if (!answers) return std::nullopt;
    PositionSample sample{now - age, position};
    sample.buttons = buttons;
    sample.orientation = orientation;
    sample.opening = opening;
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return told = force; }
  Effort apply_all(const Effort& effort) noexcept override {
    told = effort.force;
    return told_all = effort;
  }
};

struct Rig {
  explicit Rig(const SafeDevice::Config& config = {}) : safe(config, puppet) {}

  Vec3 step(const Vec3& asked = Vec3::Zero()) {
    now += std::chrono::milliseconds(1);
    seen = safe.read(now).has_value();
    return safe.apply(asked);
  }
  Effort step_all(const Effort& asked) {
    now += std::chrono::milliseconds(1);
    seen = safe.read(now).has_value();
    return safe.apply_all(asked);
  }
  Effort steps_all(int count, const Effort& asked) {
    Effort last;
    for (int i = 0; i < count; ++i) last = step_all(asked);
    return last;
  }
  Vec3 steps(int count, const Vec3& asked = Vec3::Zero()) {
    Vec3 last = Vec3::Zero();
    for (int i = 0; i < count; ++i) last = step(asked);
    return last;
  }
  void arm() {
    steps(60);
    safe.arm();
    step();
    ASSERT_EQ(safe.status().state, SafetyState::kArmed);
  }
  SafetyState state() const { return safe.status().state; }
  SafetyFault fault() const { return safe.status().last_fault; }

  Puppet puppet;
  SafeDevice safe;
  LocalTime now{std::chrono::seconds(1)};
  bool seen = false;
};

inline const Vec3 kPush(3, 0, -4);
inline const Effort kAll{.force = kPush, .torque = {0, 0.1, 0}, .grip = -2};
inline const Effort kNothing{};

inline Effort operator*(double share, const Effort& effort) {
  return {.force = share * effort.force, .torque = share * effort.torque, .grip = share * effort.grip};
}

inline void expect_near(const Effort& a, const Effort& b) {
  EXPECT_NEAR((a.force - b.force).norm() + (a.torque - b.torque).norm() + std::abs(a.grip - b.grip), 0, 1e-12);
}

}  // namespace tendon
