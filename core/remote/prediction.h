// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"

namespace tendon {

/// The predicted force of a model of the remote environment near a position:
///     F(x + ξ) ≈ force − stiffness · ξ          N, on the hand; stiffness = −∂F/∂x, N/m
struct Prediction {
  Vec3 force = Vec3::Zero();
  Mat3 stiffness = Mat3::Zero();
};

}  // namespace tendon
