// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"

namespace tendon {

/// Measurements of a handle other than its position, and the torque and grip force since the previous step.
struct HandleSample {
  std::optional<Turning> turning{};  ///< empty if not measured
  std::optional<Grip> grip{};        ///< empty if there is no gripper
  Vec3 torque = Vec3::Zero();        ///< N·m, applied to the hand
  double grip_force = 0;             ///< N, applied to the fingers
};

}  // namespace tendon
