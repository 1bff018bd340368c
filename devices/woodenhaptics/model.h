// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

/// The WoodenHaptics by Haptikfabriken and related devices: arms of wood or aluminium with three motors, whose
/// drawings, firmware and host library are published. All data are from github.com/forsslund/haptikfabrikenapi, commit
/// b8d6c94 of 2021-06-10: src/haptikfabrikenapi.h (the numbers), src/kinematics.cpp, firmware/main.cpp.
namespace tendon::woodenhaptics {

/// A body of the arm and its motor, which are coupled by a cable from a capstan.
struct Joint {
  double capstan;          ///< m, diameter of the motor's capstan
  double body;             ///< m, diameter of the drum on the body
  double length;           ///< m, length of the body
  double torque_constant;  ///< N·m/A of the motor
  int counts_per_turn;     ///< of the motor's encoder, including quadrature
  /// Sign of the body's angle for a positive count: -1 where the source says "motor and body aligned", otherwise 1.
  int direction;
  std::int16_t calibration;  ///< count in the calibration pose
};

/// Parameters of one arm. Body A rotates about the vertical axis, B and C raise the two links. Each motor drives one
/// angle.
struct Model {
  std::string_view name;
  std::array<Joint, 3> joints;
  /// m, middle of the workspace relative to the point where the axis of A meets the base
  std::array<double, 3> origin;
  double workspace_radius;  ///< m
  double full_scale;        ///< A, current for which the amplifiers are configured at 90 % pulse width
  double max_force;         ///< N
};

/// All supported models.
std::span<const Model> models() noexcept;

/// Returns null if there is no model of this name.
const Model* find_model(std::string_view name) noexcept;

/// Returns true for Polhem v2 and v3. They have a closed linkage whose kinematics ("polhem.h") are not published. They
/// are not supported because a force in a wrong direction is worse than none.
bool has_unpublished_kinematics(std::string_view name) noexcept;

}  // namespace tendon::woodenhaptics
