// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

/// WoodenHaptics and other arms of wood or aluminium by Haptikfabriken, with published drawings, firmware and host
/// library. Source: github.com/forsslund/haptikfabrikenapi, commit b8d6c94 of 2021-06-10: src/haptikfabrikenapi.h (the
/// numbers), src/kinematics.cpp, firmware/main.cpp.
namespace tendon::woodenhaptics {

/// A body, and the motor driving it using a cable and a capstan.
struct Joint {
  double capstan;            ///< m, diameter
  double body;               ///< m, diameter of its drum
  double length;             ///< m
  double torque_constant;    ///< N·m/A
  int counts_per_turn;       ///< including quadrature
  int direction;             ///< 1, or -1 where the source says "motor and body aligned"
  std::int16_t calibration;  ///< count in the calibration pose
};

/// Body A rotates about the vertical axis, and B and C raise the two links. Each motor drives one angle.
struct Model {
  std::string_view name;
  std::array<Joint, 3> joints;
  std::array<double, 3> origin;  ///< m, middle of the workspace, relative to the axis of A at the base
  double workspace_radius;       ///< m
  double full_scale;             ///< A, at 90 % pulse width
  double max_force;              ///< N
};

std::span<const Model> models() noexcept;

const Model* find_model(std::string_view name) noexcept;  ///< null if there is no such model

/// Polhem v2 and v3. The kinematics ("polhem.h") were not published, and forces in a wrong direction are dangerous.
bool has_unpublished_kinematics(std::string_view name) noexcept;

}  // namespace tendon::woodenhaptics
