// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"

namespace tendon {

/// Measurements of a handle other than its position, and the torque and grip force since the previous step.
struct HandleSample {
  std::optional<Turning> turning{};  ///< empty: not measured
  std::optional<Grip> grip{};        ///< empty: no gripper
  Vec3 torque = Vec3::Zero();        ///< N·m, on the hand, as applied
  double grip_force = 0;             ///< N, on the fingers, as applied
};

}  // namespace tendon
