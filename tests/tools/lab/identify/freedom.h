// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "core/handle/handle_bounds.h"
#include "core/handle/turn_friction.h"

namespace tendon::lab {

enum class Freedom : std::uint8_t {
  kMovement,  ///< one axis of the position; m, N
  kRotation,  ///< rotation about one axis; rad, N·m
  kGripper,   ///< fingers; m of travel, N at the fingers
};

struct FreedomInfo {
  Freedom freedom;
  std::string_view name;      ///< value of `tendon-identify --of`
  std::string_view position;  ///< column of a CSV file
  std::string_view effort;    ///< column of a CSV file
  std::string_view position_unit;
  std::string_view effort_unit;
  std::string_view viscous_unit;
  std::string_view inertia_unit;
  std::string_view table;        ///< table of the scene for the bounds
  std::string_view coulomb_key;  ///< key in that table
  std::string_view viscous_key;
  double share;                          ///< ratio of the published bound to the estimate
  HandleBounds bounds;                   ///< the limits of real handles
  std::string_view wrong_position_unit;  ///< common wrong unit of positions, for error messages
  std::string_view wrong_inertia_unit;
  std::string_view wrong_step_unit;
};

inline constexpr FreedomInfo kFreedoms[] = {
    {Freedom::kMovement, "movement", "x_m", "force_n", "m", "N", "N·s/m", "kg", "limiter", "coulomb_friction_n",
     "viscous_friction_n_s_per_m", 1, kMovementBounds, "mm", "g", "µm"},
    {Freedom::kRotation, "rotation", "angle_rad", "torque_nm", "rad", "N·m", "N·m·s/rad", "kg·m²", "limiter.rotation",
     "coulomb_friction_nm", "viscous_friction_nm_s_per_rad", kTurnFrictionShare, kRotationBounds, "degrees", "g·cm²",
     "mrad"},
    {Freedom::kGripper, "gripper", "x_m", "force_n", "m", "N", "N·s/m", "kg", "limiter.gripper", "coulomb_friction_n",
     "viscous_friction_n_s_per_m", 1, kMovementBounds, "mm", "g", "µm"},
};

constexpr const FreedomInfo& info(Freedom freedom) noexcept { return kFreedoms[static_cast<std::size_t>(freedom)]; }

}  // namespace tendon::lab
