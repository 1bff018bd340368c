// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_environment.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

Vec3 along_surface(const Vec3& v, const Vec3& normal) { return v - normal.dot(v) * normal; }

/// Reduces the part `moving` of `momentum` by up to `most`. Returns true if this part has stopped.
bool brake(Vec3& momentum, const Vec3& moving, double most) {
  const double size = moving.norm();
  momentum -= size <= most ? moving : Vec3((most / size) * moving);
  return size <= most;
}

}  // namespace

SimulatedEnvironment::SimulatedEnvironment(Config config) : config_(std::move(config)), touched_(config_.walls.size()) {
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
    touched_[i].pressed = 0;
    const double age = t - seconds(wall.from);
    if (age < 0 || (wall.until && t >= seconds(*wall.until))) continue;
    const double depth = wall.normal.dot(wall.point - x) + wall.speed * age;
    if (!(depth > 0)) continue;
    touched_[i].pressed = std::max(0.0, wall.stiffness * depth - wall.damping * (wall.normal.dot(v) - wall.speed));
    push += touched_[i].pressed * wall.normal;
  }
  return push;
}

Vec3 SimulatedEnvironment::rub(Vec3& momentum, double h) noexcept {
  const Vec3 before = momentum;
  for (std::size_t i = 0; i < config_.walls.size(); ++i) {
    const double most = h / 2 * config_.walls[i].friction * touched_[i].pressed;
    touched_[i].sticks = most > 0 && brake(momentum, along_surface(momentum, config_.walls[i].normal), most);
  }
  sticks_ = config_.friction > 0 && brake(momentum, momentum, h / 2 * config_.friction);
  return (momentum - before) * (2 / h);
}

void SimulatedEnvironment::stop(Vec3& velocity) const noexcept {
  for (std::size_t i = 0; i < config_.walls.size(); ++i) {
    if (touched_[i].sticks) velocity -= along_surface(velocity, config_.walls[i].normal);
  }
  if (sticks_) velocity.setZero();
}

}  // namespace tendon
