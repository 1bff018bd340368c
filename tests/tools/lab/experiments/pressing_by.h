// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_method.h"
#include "tests/core/teleoperation/pressing.h"

namespace tendon::lab {

inline Pressing pressing_by(CouplingMethod method) {
  Pressing with{.method = method};
  if (method == CouplingMethod::kWaves) {
    with.impedance = 10;
    with.tank = false;
  }
  if (method == CouplingMethod::kPositionForce || method == CouplingMethod::kSurface) with.stiffness = 1000;
  return with;
}

}  // namespace tendon::lab
