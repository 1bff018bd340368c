// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_rotation.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "core/base/expect.h"
#include "core/base/portable_math.h"
#include "devices/simulated/expect_part.h"

namespace tendon {
namespace {

/// In the base frame, for rotation_by(φ(t)): ω = φ̇ + (1 − cos φ)/φ² φ × φ̇ + (φ − sin φ)/φ³ φ × (φ × φ̇)
Vec3 angular_velocity(const ScriptedMotion::Point& turn) noexcept {
  const Vec3& vector = turn.position;
  const double angle = vector.norm();
  double first = 0.5;
  double second = 1.0 / 6;  // accurate for very small angles
  if (angle > 1e-8) {
    const double half = portable::sin(angle / 2);
    first = 2 * half * half / (angle * angle);
    second = (angle - portable::sin(angle)) / (angle * angle * angle);
  }
  const Vec3 across = vector.cross(turn.velocity);
  return turn.velocity + first * across + second * vector.cross(across);
}

}  // namespace

SimulatedRotation::SimulatedRotation(Config config) : config_(std::move(config)) {
  expect_above_zero(config_.inertia, "rotation.inertia");
  if (config_.start) expect_finite(*config_.start, "rotation.start");
  expect_finite(config_.start_angular_velocity, "rotation.start_angular_velocity");
  expect_part(config_.viscous_friction, "rotation.viscous_friction");
  expect_part(config_.coulomb_friction, "rotation.coulomb_friction");
  expect_part(config_.max_torque, "rotation.max_torque");
  expect_part(config_.encoder_step, "rotation.encoder_step");
  if (config_.hand) {
    expect_above_zero(config_.hand->stiffness, "rotation.hand.stiffness");
    expect_not_negative(config_.hand->damping, "rotation.hand.damping");
  }
  Vec3 start = Vec3::Zero();
  if (config_.hand) start = config_.hand->motion.at(0).position;
  start_ = rotation_by(config_.start.value_or(start));
  truth_.orientation = start_;
  truth_.angular_velocity = config_.start_angular_velocity;
  truth_.kinetic_energy = config_.inertia * truth_.angular_velocity.squaredNorm() / 2;
}

double SimulatedRotation::resistance(double h) const noexcept {
  double resists = config_.viscous_friction.value_or(0);
  if (config_.hand) resists += config_.hand->damping + h / 2 * config_.hand->stiffness;
  return config_.inertia + h / 2 * resists;
}

Vec3 SimulatedRotation::drive(double t) const noexcept {
  const ScriptedMotion::Point wanted = config_.hand->motion.at(t);
  return config_.hand->stiffness * turn_between(truth_.orientation, rotation_by(wanted.position)) +
         config_.hand->damping * angular_velocity(wanted);
}

void SimulatedRotation::integrate(double begin, Duration::rep substeps, double h) noexcept {
  const double resists = resistance(h);
  const double coulomb = config_.coulomb_friction.value_or(0);
  Vec3& velocity = truth_.angular_velocity;
  for (Duration::rep i = 0; i < substeps; ++i) {
    Vec3 push = truth_.device_torque;
    Vec3 wanted = Vec3::Zero();
    if (config_.hand) wanted = drive(begin + h * (static_cast<double>(i) + 0.5));
    push += wanted;

    Vec3 mean = config_.inertia * velocity + h / 2 * push;  // the half-step momentum, then the mean velocity
    const double momentum = mean.norm();
    const double lost = h / 2 * coulomb;
    mean *= momentum > lost ? (1 - lost / momentum) / resists : 0.0;
    velocity = 2 * mean - velocity;
    if (coulomb > 0 && velocity.dot(mean) <= 0 && push.norm() <= coulomb) velocity.setZero();

    if (config_.hand) {
      truth_.hand_torque = wanted - (config_.hand->damping + h / 2 * config_.hand->stiffness) * mean;
      truth_.hand_work += h * truth_.hand_torque.dot(mean);
    }
    truth_.orientation = product(rotation_by(h * mean), truth_.orientation);
  }
  truth_.orientation = unit(truth_.orientation);
  truth_.kinetic_energy = config_.inertia * velocity.squaredNorm() / 2;
}

Quat SimulatedRotation::sample() const noexcept {
  if (!config_.encoder_step) return truth_.orientation;
  const double step = *config_.encoder_step;
  const Vec3 turned = turn_between(start_, truth_.orientation);
  return product(rotation_by((turned.array() / step + 0.5).floor().matrix() * step), start_);
}

}  // namespace tendon
