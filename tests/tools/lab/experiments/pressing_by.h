// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/port_state.h"
#include "tests/core/teleoperation/pressing.h"

namespace tendon::lab {

inline Pressing pressing_by(CouplingMethod method) {
  Pressing with{.method = method};
  switch (method) {
    case CouplingMethod::kPositionPosition:
    case CouplingMethod::kPassivity:
    case CouplingMethod::kSetPosition:
    case CouplingMethod::kRate:
      break;
    case CouplingMethod::kWaves:
      with.impedance = 10;
      with.tank = false;
      break;
    case CouplingMethod::kPositionForce:
    case CouplingMethod::kSurface:
      with.stiffness = 1000;
      break;
  }
  return with;
}

}  // namespace tendon::lab
