// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/drawn_handle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/base/rotation.h"

namespace tendon::simulation {

std::string number(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.4g", value);
  return buffer.data();
}

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kMargin = 1.02;  ///< minimum ratio of true friction to the limiter's value

Friction draw_friction(Dice& dice, double coulomb_decade, double viscous_decade) {
  return {dice.chance(0.2) ? 0.0 : dice.decades(coulomb_decade - 1, coulomb_decade),
          dice.decades(viscous_decade - 1, viscous_decade)};
}

void draw_true_friction(Dice& dice, const Friction& friction, std::optional<double>& coulomb,
                        std::optional<double>& viscous) {
  if (friction.coulomb > 0) coulomb = friction.coulomb * (kMargin + dice.uniform());
  viscous = friction.viscous * (kMargin + dice.uniform());
}

ScriptedMotion draw_turns(Dice& dice, double least, double most) {
  const Vec3 about = dice.direction();
  if (dice.chance(0.5)) {
    return ScriptedMotion(ScriptedMotion::RampHold{.from = -dice.within(least, most) * about,
                                                   .to = dice.within(least, most) * about,
                                                   .ramp = dice.milliseconds(50, 1500),
                                                   .hold = dice.milliseconds(0, 500)});
  }
  return ScriptedMotion(ScriptedMotion::Sine{
      .amplitude = dice.within(least, most), .frequency = dice.decades(-0.5, 0.8), .direction = about});
}

/// Opening and closing fingers; only x is used.
ScriptedMotion draw_squeezes(Dice& dice, double open) {
  return ScriptedMotion(ScriptedMotion::RampHold{.from = dice.within(0, 0.4) * open * Vec3::UnitX(),
                                                 .to = dice.within(0.5, 1.2) * open * Vec3::UnitX(),
                                                 .ramp = dice.milliseconds(50, 1000),
                                                 .hold = dice.milliseconds(0, 500)});
}

void draw_rotation(Dice& dice, DrawnWorld& world, bool motors) {
  HapticController::Config& control = world.config.loop.control;
  const Friction friction = draw_friction(dice, -3.5, -2.5);
  // Bounds the worst rotation in the longest pause to half a turn.
  const double max_torque = friction.coulomb + friction.viscous * dice.decades(0.5, 1.6);
  const double max_slew = dice.chance(0.3) ? kInf : max_torque * dice.decades(0.5, 3);
  const double encoder_step = dice.chance(0.2) ? dice.decades(-5, -3.5) : 0;
  if (motors) {
    control.rotation = RotationLimits{
        .friction = friction, .max_torque = max_torque, .max_slew = max_slew, .encoder_step = encoder_step};
    world.port.rotation = friction;
  }
  if (auto* const adversary = std::get_if<AdversaryDevice::Config>(&world.device)) {
    adversary->turn = AdversaryDevice::Turn{.friction = friction,
                                            .largest = dice.decades(-3, -1),
                                            .clamp = motors ? dice.within(0.3, 1.5) * max_torque : 0};
    return;
  }
  SimulatedRotation::Config rotation{.inertia = dice.decades(-5, -3.5)};
  draw_true_friction(dice, friction, rotation.coulomb_friction, rotation.viscous_friction);
  if (motors) rotation.max_torque = dice.within(0.3, 1.5) * max_torque;
  if (encoder_step > 0) rotation.encoder_step = encoder_step;
  rotation.hand = SimulatedRotation::Hand{
      .stiffness = dice.decades(-2.5, 0), .damping = dice.decades(-4, -2), .motion = draw_turns(dice, 0.05, 1)};
  std::get<SimulatedDevice::Config>(world.device).rotation = std::move(rotation);
}

void draw_gripper(Dice& dice, DrawnWorld& world, bool motor) {
  HapticController::Config& control = world.config.loop.control;
  const Friction friction = draw_friction(dice, -1, -0.5);
  const double arm = dice.within(0.03, 0.1);
  const double max_force = dice.decades(-0.5, 1);
  const double open = dice.within(0.3, 1);
  if (motor) {
    control.grip = GripLimits{.friction = friction,
                              .arm = arm,
                              .max_force = max_force,
                              .max_slew = dice.chance(0.3) ? kInf : max_force * dice.decades(0.5, 3)};
    world.port.grip = friction;
  }
  world.port.arm = arm;
  if (auto* const adversary = std::get_if<AdversaryDevice::Config>(&world.device)) {
    adversary->fingers = AdversaryDevice::Fingers{
        .friction = friction, .arm = arm, .open = open, .clamp = motor ? dice.within(0.3, 1.5) * max_force : 0};
    return;
  }
  SimulatedGripper::Config gripper{.open = open, .arm = arm, .mass = dice.decades(-2.3, -1.3)};
  draw_true_friction(dice, friction, gripper.coulomb_friction, gripper.viscous_friction);
  if (motor) gripper.max_force = dice.within(0.3, 1.5) * max_force;
  gripper.hand = SimulatedGripper::Hand{
      .stiffness = dice.decades(1, 2.7), .damping = dice.decades(-1, 0.5), .motion = draw_squeezes(dice, open)};
  std::get<SimulatedDevice::Config>(world.device).gripper = gripper;
}

/// Each press has its own button and is longer than any interval of the loop; two come after recovery.
void draw_presses(Dice& dice, DrawnWorld& world) {
  auto& device = std::get<SimulatedDevice::Config>(world.device);
  constexpr std::array<std::array<double, 2>, 4> kFrom{{{0, 3}, {2, 6}, {8.7, 8.8}, {9.2, 9.3}}};  // s
  for (std::uint32_t i = 0; i < kFrom.size(); ++i) {
    const bool pauses = world.pauses();
    device.presses.push_back({.button = i,
                              .from = from_seconds(dice.within(kFrom[i][0], kFrom[i][1])),
                              .length = dice.milliseconds(pauses ? 150 : 6, pauses ? 200 : 100)});
  }
}

}  // namespace

void draw_handle(Dice dice, DrawnWorld& world, const Sabotage& sabotage) {
  const Law law = world.config.loop.control.limiter.law;
  const bool bounded = law == Law::kAol || law == Law::kAolPlus;
  const bool adversary = std::holds_alternative<AdversaryDevice::Config>(world.device);
  const bool turns = dice.chance(0.6) || sabotage.torque != 1;
  const bool torques = bounded && (dice.chance(0.7) || sabotage.torque != 1);
  const bool grips = dice.chance(0.5) || sabotage.grip != 1;
  const bool squeezes = bounded && (dice.chance(0.7) || sabotage.grip != 1);
  if (turns) draw_rotation(dice, world, torques);
  if (grips) draw_gripper(dice, world, squeezes);
  if (!adversary && dice.chance(0.8)) draw_presses(dice, world);
  if (sabotage == Sabotage{}) return;
  auto& device = std::get<AdversaryDevice::Config>(world.device);
  device.more = sabotage;
  if (device.turn && torques) device.turn->clamp = kInf;
  if (device.fingers && squeezes) device.fingers->clamp = kInf;
}

std::string describe_handle(const DrawnWorld& world) {
  const HapticController::Config& control = world.config.loop.control;
  std::string text;
  const auto* const simulated = std::get_if<SimulatedDevice::Config>(&world.device);
  const auto* const adversary = std::get_if<AdversaryDevice::Config>(&world.device);
  if (control.rotation) {
    text += ", rotation with motors of " + number(1e3 * control.rotation->max_torque) + " mN·m";
  } else if (simulated != nullptr ? simulated->rotation.has_value() : adversary->turn.has_value()) {
    text += ", rotation without motors";
  }
  if (control.grip) {
    text += ", a gripper of " + number(control.grip->max_force) + " N";
  } else if (simulated != nullptr ? simulated->gripper.has_value() : adversary->fingers.has_value()) {
    text += ", a gripper without a motor";
  }
  if (simulated != nullptr && !simulated->presses.empty()) text += ", buttons";
  return text;
}

void answer_handle(const DrawnClient& client, Dice& dice, const DeviceState& hand, Touch& touch) {
  if (!hand.turning && !hand.grip) return;
  const double k = client.stiffness * 1e-4;  // N·m/rad
  const double turned_by = hand.turning ? rotation_vector(hand.turning->orientation).norm() : 0;
  const Vec3 turned = hand.turning ? rotation_vector(hand.turning->orientation) : Vec3(Vec3::Zero());
  const double opening = hand.grip ? hand.grip->opening : 0;
  switch (client.engine) {
    case Engine::kSpring:
      touch.torque = -k * turned;
      touch.grip_force = -client.stiffness * 0.01 * (opening - 0.2);
      break;
    case Engine::kWall:
      touch.torque = turned_by > 0.1 ? Vec3(-k * (turned_by - 0.1) / turned_by * turned) : Vec3(Vec3::Zero());
      if (hand.turning && turned_by > 0.1) touch.angular_stiffness = k * Mat3::Identity();
      touch.grip_force = client.stiffness * 0.01 * std::max(0.0, 0.2 - opening);
      break;
    case Engine::kMillion:
      touch.torque = dice.direction() * 1e6;
      touch.grip_force = dice.chance(0.5) ? 1e6 : -1e6;
      break;
    case Engine::kSteps:
      touch.torque = dice.direction() * (dice.chance(0.5) ? 0.0 : dice.decades(-4, 0));
      touch.grip_force = dice.within(-1, 1) * dice.decades(-1, 1.5);
      break;
    case Engine::kNegative:
      touch.torque = Vec3(k * turned);
      if (hand.turning) {
        touch.torque = *touch.torque + 1e-2 * hand.turning->angular_velocity;
        touch.angular_stiffness = -k * Mat3::Identity();
        if (dice.chance(0.5)) touch.angular_stiffness->row(0) = k * dice.direction();
      }
      touch.grip_force = client.stiffness * 0.01 * opening + (hand.grip ? hand.grip->velocity : 0);
      break;
    case Engine::kPushesAlong:
      touch.torque = hand.torque_applied && hand.torque_applied->norm() > 1e-6 ? Vec3(*hand.torque_applied * 100)
                                                                               : Vec3(0.1 * dice.direction());
      touch.grip_force = hand.grip_applied.value_or(0) * 100 + (opening > 0.1 ? -0.1 : 0.1);
      break;
  }
  if (client.bad_days > 0 && dice.chance(client.bad_days)) {
    if (dice.chance(0.5)) touch.torque = Vec3(0, std::nan(""), 0);
    if (dice.chance(0.5)) touch.grip_force = kInf;
  }
  if (dice.chance(0.1)) touch.torque.reset();
  if (dice.chance(0.1)) touch.grip_force.reset();
}

}  // namespace tendon::simulation
