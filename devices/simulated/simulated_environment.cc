// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_environment.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

/// Takes up to `most` out of the part of `mean` that does not lie along `normal` (all of it, without one). What was at
/// rest already stays at rest.
void brake(Vec3& mean, Vec3& end, double most, const Vec3* normal) {
  const auto sliding = [normal](const Vec3& v) { return normal ? Vec3(v - normal->dot(v) * *normal) : v; };
  const Vec3 moving = sliding(mean);
  const double speed = moving.norm();
  if (speed <= most) {
    mean -= moving;
    end -= sliding(end);
  } else {
    const Vec3 lost = (most / speed) * moving;
    mean -= lost;
    // The device's own friction may have stopped it already: then it is not pushed back.
    if (sliding(end).squaredNorm() > 0) end -= 2 * lost;
  }
}

}  // namespace

SimulatedEnvironment::SimulatedEnvironment(Config config)
    : config_(std::move(config)), pressed_(config_.walls.size(), 0.0) {
  expect_not_negative(config_.damping, "environment.damping");
  expect_not_negative(config_.friction, "environment.friction");
  expect(config_.walls.size() <= kMostWalls, "environment.walls", static_cast<double>(config_.walls.size()),
         "at most " + std::to_string(kMostWalls));
  for (Wall& wall : config_.walls) {
    expect_finite(wall.point, "environment.wall.point");
    const double length = wall.normal.stableNorm();
    expect(length > 0 && std::isfinite(length), "environment.wall.normal", length, "a length above 0");
    wall.normal /= length;
    expect_above_zero(wall.stiffness, "environment.wall.stiffness");
    expect_not_negative(wall.damping, "environment.wall.damping");
    expect_not_negative(wall.friction, "environment.wall.friction");
    expect(std::isfinite(wall.speed), "environment.wall.speed", wall.speed, "a number of m/s");
    expect_not_negative(seconds(wall.from), "environment.wall.from");
    if (wall.until) {
      expect(*wall.until > wall.from, "environment.wall.until", seconds(*wall.until),
             "a time after `from`, " + shortest(seconds(wall.from)) + " s");
    }
  }
}

Vec3 SimulatedEnvironment::push(double t, const Vec3& x, const Vec3& v) noexcept {
  Vec3 push = Vec3::Zero();
  for (std::size_t i = 0; i < config_.walls.size(); ++i) {
    const Wall& wall = config_.walls[i];
    pressed_[i] = 0;
    const double age = t - seconds(wall.from);
    if (age < 0 || (wall.until && t >= seconds(*wall.until))) continue;
    const double depth = wall.normal.dot(wall.point - x) + wall.speed * age;
    if (!(depth > 0)) continue;
    pressed_[i] = std::max(0.0, wall.stiffness * depth - wall.damping * (wall.normal.dot(v) - wall.speed));
    push += pressed_[i] * wall.normal;
  }
  return push;
}

Vec3 SimulatedEnvironment::rub(Vec3& mean, Vec3& end, double resistance, double h) const noexcept {
  const Vec3 before = mean;
  const double loss = h / 2 / resistance;  // of velocity, for each N
  for (std::size_t i = 0; i < config_.walls.size(); ++i) {
    const double most = loss * config_.walls[i].friction * pressed_[i];
    if (most > 0) brake(mean, end, most, &config_.walls[i].normal);
  }
  if (config_.friction > 0) brake(mean, end, loss * config_.friction, nullptr);
  return (mean - before) / loss;
}

}  // namespace tendon
