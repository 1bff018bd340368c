// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_gripper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/expect.h"
#include "devices/simulated/expect_part.h"

namespace tendon {
SimulatedGripper::SimulatedGripper(Config config) : config_(std::move(config)), most_(config_.arm * config_.open) {
  expect_above_zero(config_.open, "gripper.open");
  expect_above_zero(config_.arm, "gripper.arm");
  expect_above_zero(config_.mass, "gripper.mass");
  if (config_.start) {
    expect(*config_.start >= 0 && *config_.start <= config_.open, "gripper.start", *config_.start,
           "0 rad or more, and no more than open");
  }
  expect_part(config_.viscous_friction, "gripper.viscous_friction");
  expect_part(config_.coulomb_friction, "gripper.coulomb_friction");
  expect_part(config_.max_force, "gripper.max_force");
  expect_part(config_.encoder_step, "gripper.encoder_step");
  if (config_.hand) {
    expect_above_zero(config_.hand->stiffness, "gripper.hand.stiffness");
    expect_not_negative(config_.hand->damping, "gripper.hand.damping");
  }
  const double hands = config_.hand ? config_.hand->motion.at(0).position.x() : 0;
  truth_.position = std::clamp(config_.arm * config_.start.value_or(hands), 0.0, most_);
}

DeviceInfo::Gripper SimulatedGripper::info() const noexcept {
  return {.open = config_.open, .arm = config_.arm, .max_force = config_.max_force.value_or(0)};
}

double SimulatedGripper::drive(double t) const noexcept {
  const ScriptedMotion::Point wanted = config_.hand->motion.at(t);
  return config_.hand->stiffness * (config_.arm * wanted.position.x() - truth_.position) +
         config_.hand->damping * config_.arm * wanted.velocity.x();
}

void SimulatedGripper::integrate(double begin, Duration::rep substeps, double h) noexcept {
  const double coulomb = config_.coulomb_friction.value_or(0);
  double hands = 0;  // N·s/m, damping of the hand
  if (config_.hand) hands = config_.hand->damping + h / 2 * config_.hand->stiffness;
  const double resistance = config_.mass + h / 2 * (config_.viscous_friction.value_or(0) + hands);
  double& velocity = truth_.velocity;
  for (Duration::rep i = 0; i < substeps; ++i) {
    double wanted = 0;
    if (config_.hand) wanted = drive(begin + h * (static_cast<double>(i) + 0.5));
    const double push = truth_.device_force + wanted;

    const double momentum = config_.mass * velocity + h / 2 * push;
    const double lost = h / 2 * coulomb;
    double mean = std::abs(momentum) > lost ? (momentum - std::copysign(lost, momentum)) / resistance : 0.0;
    velocity = 2 * mean - velocity;
    if (coulomb > 0 && velocity * mean <= 0 && std::abs(push) <= coulomb) velocity = 0;

    const double before = truth_.position;
    truth_.position = before + h * mean;
    if (truth_.position < 0 || truth_.position > most_) {
      truth_.position = truth_.position < 0 ? 0 : most_;
      mean = (truth_.position - before) / h;
      velocity = 0;
    }
    if (config_.hand) {
      truth_.hand_force = wanted - hands * mean;
      truth_.hand_work += h * truth_.hand_force * mean;
    }
  }
  truth_.kinetic_energy = config_.mass * velocity * velocity / 2;
}

double SimulatedGripper::sample() const noexcept {
  const double opening = truth_.position / config_.arm;
  if (!config_.encoder_step) return opening;
  return std::floor(opening / *config_.encoder_step + 0.5) * *config_.encoder_step;
}

}  // namespace tendon
