// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/field/material.h"
#include "tests/support/dice.h"

namespace tendon::field {

/// Adds a valid random table to half of the materials.
inline void describe_table(Dice& dice, double max_stiffness, Material& material) {
  if (dice.chance(0.5)) return;
  material.table = {.step = dice.decades(-3.9, -1.1), .used = true};
  const double most = 2 * max_stiffness * material.table.step;  // N
  for (double& force : material.table.force) force = dice.within(-most, most);
  bound_table(material, max_stiffness);
}

}  // namespace tendon::field
