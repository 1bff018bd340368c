// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

/// Haptikfabriken's WoodenHaptics and its relatives: arms of wood or aluminium with three motors. Their drawings,
/// firmware and host library are published. All facts here are from github.com/forsslund/haptikfabrikenapi, commit
/// b8d6c94 of 2021-06-10: src/haptikfabrikenapi.h (the numbers), src/kinematics.cpp, firmware/main.cpp.
namespace tendon::woodenhaptics {

/// A body of the arm, and the motor that turns it by a cable from a capstan.
struct Joint {
  double capstan;          ///< m, diameter of the capstan, at the motor
  double body;             ///< m, diameter of the drum at the body
  double length;           ///< m, length of the body
  double torque_constant;  ///< N·m/A, of the motor
  int counts_per_turn;     ///< of the motor's encoder, with quadrature
  /// The sign of the body's angle for a positive count: -1 where the source says "motor and body aligned", else 1.
  int direction;
  std::int16_t calibration;  ///< the count in the calibration pose
};

/// Numbers of one arm. Body A turns about the vertical, B and C lift its two links; each motor turns one angle.
struct Model {
  std::string_view name;
  std::array<Joint, 3> joints;
  std::array<double, 3> origin;  ///< m, middle of the workspace, from the point where A's axis meets the base
  double workspace_radius;       ///< m
  double full_scale;             ///< A, the current that the amplifiers are set to give at 90 % of the pulse width
  double max_force;              ///< N
};

/// The models that can be driven.
std::span<const Model> models() noexcept;

/// The model of that name; null when there is none.
const Model* find_model(std::string_view name) noexcept;

/// True for Polhem v2 and v3: their linkage is closed, and its makers have not published the kinematics ("polhem.h").
/// They are not driven, because a force in a guessed direction is worse than none.
bool has_unpublished_kinematics(std::string_view name) noexcept;

}  // namespace tendon::woodenhaptics
