// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/arithmetic.h"
#include "protocol/limits.h"

namespace tendon {
namespace {

bool all_bounded(const auto& numbers) noexcept { return (numbers.array().abs() <= limits::kMaxValue).all(); }

bool in_bounds(const ForceTable& table) noexcept {
  return table.size >= ForceTable::kMinEntries && table.size <= ForceTable::kMaxEntries && bounded(table.first) &&
         bounded(table.step) && table.step > 0 &&
         std::all_of(table.force.begin(), table.force.begin() + table.size, [](double f) { return bounded(f); });
}

bool in_bounds(const Contact& contact) noexcept {
  return std::abs(contact.normal.norm() - 1) <= Contact::kUnitTolerance && bounded(contact.gap) &&
         (!contact.table || in_bounds(*contact.table));
}

bool in_bounds(const LocalModel& model) noexcept {
  const bool anywhere = model.valid_radius == std::numeric_limits<double>::infinity();
  return all_bounded(model.at) && all_bounded(model.stiffness) && (anywhere || bounded(model.valid_radius)) &&
         model.valid_radius >= 0 && (!model.contact || in_bounds(*model.contact));
}

}  // namespace

bool in_bounds(const ForceCommand& command) noexcept {
  return all_bounded(command.force) && (!command.model || in_bounds(*command.model)) &&
         (!command.error || (bounded(*command.error) && *command.error >= 0));
}

}  // namespace tendon
