// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/trips.h"

#include <algorithm>
#include <numbers>
#include <string>

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon {

SpeedTrip::SpeedTrip(const Config& config, double resolution)
    : config_(config), resolution_(resolution), estimator_(resolution) {
  expect_above_zero(config.max, "speed_trip.max");
}

bool SpeedTrip::tripped(LocalTime at, const Vec3& position) noexcept {
  return !(estimator_.observe(at, position).norm() <= config_.max);
}

void SpeedTrip::forget() noexcept { estimator_ = VelocityEstimator(resolution_); }

TurnTrip::TurnTrip(const Config& config, double resolution)
    : config_(config), resolution_(resolution), estimator_(resolution) {
  expect_above_zero(config.max, "turn_trip.max");
}

bool TurnTrip::tripped(LocalTime at, const Quat& orientation) noexcept {
  if (before_) turned_ += turn_between(*before_, orientation);
  before_ = orientation;
  return !(estimator_.observe(at, turned_).norm() <= config_.max);
}

void TurnTrip::forget() noexcept {
  estimator_ = VelocityEstimator(resolution_);
  before_.reset();
  turned_.setZero();
}

StepBound::StepBound(const Config& config, double resolution) : config_(config), resolution_(resolution) {
  expect_above_zero(config.max_speed, "step_bound.max_speed");
  expect_not_negative(resolution, "resolution");
}

bool StepBound::tripped(const Vec3& before, const Vec3& position, Duration elapsed) const noexcept {
  const double most = config_.max_speed * std::max(0.0, seconds(elapsed)) + std::numbers::sqrt3 * resolution_;
  return !((position - before).norm() <= most);
}

Watchdog::Watchdog(const Config& config, const char* field) : config_(config) {
  expect_above_zero(seconds(config.timeout), std::string(field) + ".timeout");
  expect_not_negative(seconds(config.ramp), std::string(field) + ".ramp");
}

DeadManSwitch::DeadManSwitch(const Config& config) : config_(config) {
  expect(config.button < 32, "dead_man.button", config.button, "a number from 0 to 31");
}

}  // namespace tendon
