// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/remote/remote_force.h"
#include "tests/support/dice.h"

namespace tendon {

/// Returns a valid contact (core/remote/answer.h) with the tool at `position`, and a wall at x = 0 or no surface.
inline Contact any_contact(Dice& dice, const Vec3& position) {
  Contact contact{.normal = -Vec3::UnitX(), .gap = -position.x()};
  if (dice.chance(0.3)) contact = {.normal = dice.direction(), .gap = dice.within(-0.01, 0.01)};
  if (dice.chance(0.5)) return contact;
  ForceTable& table = contact.table.emplace(
      ForceTable{.first = dice.chance(0.7) ? contact.gap : dice.within(-0.02, 0.02), .step = dice.decades(-5, -2)});
  table.size = static_cast<std::uint32_t>(dice.within(ForceTable::kMinEntries, ForceTable::kMaxEntries + 1));
  for (std::size_t i = 0; i < table.size; ++i) table.force[i] = (dice.chance(0.8) ? 1 : -1) * dice.decades(-2, 3);
  return contact;
}

}  // namespace tendon
