// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/force_shares.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/expect.h"

namespace tendon {

namespace {

constexpr double kBoundTime_s = 1.0;  ///< same as × 0.999 each ms
constexpr double kWarm = 0.7;
constexpr double kCool = 0.5;

/// Returns the factor for reducing `size` to `max`, or 0 for NaN.
double up_to(double max, double size) noexcept {
  if (size <= max) return 1;
  return size > max && max > 0 ? max / size : 0;
}

}  // namespace

ForceLimit::ForceLimit(const Config& config, const char* field) : config_(config) {
  expect_above_zero(config.max, std::string(field) + ".max");
}

double ForceLimit::share(const Vec3& asked) const noexcept { return up_to(config_.max, asked.norm()); }

GrowthLimit::GrowthLimit(const Config& config, const char* field) : config_(config) {
  expect_above_zero(config.rate, std::string(field) + ".rate");
}

double GrowthLimit::share(const Vec3& asked, const Vec3& before, Duration elapsed) const noexcept {
  const double size = asked.norm();
  if (size == 0) return 1;
  const double there = std::max(0.0, before.dot(asked) / size);
  return up_to(there + config_.rate * std::max(0.0, seconds(elapsed)), size);
}

RampIn::RampIn(const Config& config) : config_(config) { expect_above_zero(seconds(config.time), "ramp_in.time"); }

double RampIn::share(Duration since_armed) const noexcept {
  return std::clamp(seconds(since_armed) / seconds(config_.time), 0.0, 1.0);
}

double RampOut::share(LocalTime now) const noexcept {
  if (time <= Duration::zero()) return 0;
  return std::clamp(1 - seconds(now - since) / seconds(time), 0.0, 1.0);
}

HeatLimit::HeatLimit(const Config& config) : config_(config), bound_(config.peak) {
  expect_above_zero(config.continuous, "heat_limit.continuous");
  expect(config.peak >= config.continuous && std::isfinite(config.peak), "heat_limit.peak", config.peak,
         "a finite number, not below continuous");
  expect_above_zero(seconds(config.time_constant), "heat_limit.time_constant");
}

void HeatLimit::observe(double held, Duration elapsed) noexcept {
  const double t = std::max(0.0, seconds(elapsed));
  const double load = held / config_.continuous;
  // Exact for a constant force, even over a long interval.
  heat_ += (load * load - heat_) * -std::expm1(-t / seconds(config_.time_constant));
  const double moved = -std::expm1(-t / kBoundTime_s);
  if (heat_ >= 1) {
    bound_ = config_.continuous;
  } else if (heat_ > kWarm) {
    bound_ += (config_.continuous - bound_) * moved;
  } else if (heat_ < kCool) {
    bound_ += (config_.peak - bound_) * moved;
  }
}

double HeatLimit::share(const Vec3& asked) const noexcept { return up_to(bound_, asked.norm()); }

Workspace::Workspace(const Config& config) : config_(config) {
  expect_finite(config.centre, "workspace.centre");
  if (const auto* sphere = std::get_if<Sphere>(&config.shape)) {
    expect_above_zero(sphere->radius, "workspace.radius");
  } else {
    for (const double half : std::get<Box>(config.shape).half) expect_above_zero(half, "workspace.half");
  }
  expect_above_zero(config.margin, "workspace.margin");
}

Vec3 Workspace::outside(const Vec3& position) const noexcept {
  const Vec3 from_centre = position - config_.centre;
  if (const auto* sphere = std::get_if<Sphere>(&config_.shape)) {
    const double distance = from_centre.norm();
    if (distance <= sphere->radius) return Vec3::Zero();
    return from_centre * (1 - sphere->radius / distance);
  }
  const Vec3& half = std::get_if<Box>(&config_.shape)->half;
  return from_centre - from_centre.cwiseMax(-half).cwiseMin(half);
}

double Workspace::share(const Vec3& asked, const Vec3& position) const noexcept {
  const Vec3 beyond = outside(position);
  const double depth = beyond.norm();
  const double size = asked.norm();
  if (depth == 0 || size == 0) return 1;
  const double outward = std::clamp(asked.dot(beyond) / (size * depth), 0.0, 1.0);
  return 1 - std::min(1.0, depth / config_.margin) * outward;
}

}  // namespace tendon
