// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/wire/fields/reader.h"
#include "protocol/wire/fields/writer.h"
#include "protocol/wire/generated/request_fields.h"

namespace tendon {
namespace {

bool all_bounded(const auto& numbers) noexcept { return (numbers.array().abs() <= limits::kMaxValue).all(); }

bool in_bounds(const ForceTable& table) noexcept {
  return table.size >= ForceTable::kMinEntries && table.size <= ForceTable::kMaxEntries && bounded(table.first) &&
         bounded(table.step) && table.step > 0 &&
         std::all_of(table.force.begin(), table.force.begin() + table.size, [](double f) { return bounded(f); });
}

bool in_bounds(const Contact& contact) noexcept {
  return wire::is_unit(contact.normal) && bounded(contact.gap) && (!contact.table || in_bounds(*contact.table));
}

bool in_bounds(const LocalModel& model) noexcept {
  const bool anywhere = model.valid_radius == std::numeric_limits<double>::infinity();
  return all_bounded(model.at) && all_bounded(model.stiffness) && (anywhere || bounded(model.valid_radius)) &&
         model.valid_radius >= 0 && (!model.contact || in_bounds(*model.contact));
}

bool in_bounds(const RemoteTorque& torque) noexcept {
  return all_bounded(torque.torque) &&
         (!torque.model || (is_rotation(torque.model->at) && all_bounded(torque.model->stiffness)));
}

bool is_finite(const RemoteTorque& torque) noexcept {
  if (!torque.torque.allFinite()) return false;
  if (!torque.model) return true;
  const Quat& at = torque.model->at;
  return torque.model->stiffness.allFinite() && std::isfinite(at.w) && std::isfinite(at.x) && std::isfinite(at.y) &&
         std::isfinite(at.z);
}

/// Encodes a request and returns the name of a field that would be refused.
template <class Wanted, class List>
std::string_view refused(Wanted& wanted, List list) noexcept {
  wanted.device = 0;
  std::array<wire::Byte, 128> bytes;
  wire::Writer out(bytes.data());
  list(out, wanted);
  wire::Reader in(bytes.data(), out.at());
  Wanted received;
  list(in, received);
  return in.refused() == nullptr ? std::string_view() : in.refused();
}

}  // namespace

bool in_bounds(const ForceCommand& command) noexcept {
  return all_bounded(command.force) && (!command.model || in_bounds(*command.model)) &&
         (!command.error || (bounded(*command.error) && *command.error >= 0)) &&
         (!command.torque || in_bounds(*command.torque)) && (!command.grip_force || bounded(*command.grip_force));
}

std::string_view refused_field(SetOutput wanted) noexcept { return refused(wanted, wire::kSetOutputFields); }
std::string_view refused_field(SetScale wanted) noexcept { return refused(wanted, wire::kSetScaleFields); }
std::string_view refused_field(SetShare wanted) noexcept { return refused(wanted, wire::kSetShareFields); }

bool is_finite(const ForceCommand& command) noexcept {
  const auto contact_is_finite = [](const Contact& contact) {
    if (!contact.normal.allFinite() || !std::isfinite(contact.gap)) return false;
    if (!contact.table) return true;
    const ForceTable& table = *contact.table;
    const auto size = std::min<std::size_t>(table.size, table.force.size());
    return std::isfinite(table.first) && std::isfinite(table.step) &&
           std::all_of(table.force.begin(), table.force.begin() + static_cast<std::ptrdiff_t>(size),
                       [](double f) { return std::isfinite(f); });
  };
  const auto model_is_finite = [&](const LocalModel& model) {
    return model.at.allFinite() && model.stiffness.allFinite() && !std::isnan(model.valid_radius) &&
           (!model.contact || contact_is_finite(*model.contact));
  };
  return command.force.allFinite() && (!command.model || model_is_finite(*command.model)) &&
         (!command.error || std::isfinite(*command.error)) && (!command.torque || is_finite(*command.torque)) &&
         (!command.grip_force || std::isfinite(*command.grip_force));
}

std::string_view objection(const ForceCommand& command) noexcept {
  if (in_bounds(command)) return {};
  if (!command.force.allFinite()) return "the force is not finite (NaN or infinity)";
  if (!all_bounded(command.force)) return "the force exceeds 1e12 N";
  if (command.torque && !command.torque->torque.allFinite()) return "the torque is not finite (NaN or infinity)";
  if (command.torque && !all_bounded(command.torque->torque)) return "the torque exceeds 1e12 N·m";
  if (command.torque && !in_bounds(*command.torque)) {
    return "its rotation model has a number out of bounds (WIRE.md), or an orientation whose length is not 1";
  }
  if (command.grip_force && !bounded(*command.grip_force)) return "the grip force is not finite, or exceeds 1e12 N";
  return "its stiffness, radius, contact or error is not finite, or out of the bounds in WIRE.md";
}

}  // namespace tendon
