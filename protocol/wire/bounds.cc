// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/bounds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <variant>

#include "core/base/arithmetic.h"
#include "core/base/rotation.h"
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

bool in_bounds(const RemoteTorque& torque) noexcept {
  return all_bounded(torque.torque) &&
         (!torque.model || (is_rotation(torque.model->at) && all_bounded(torque.model->stiffness)));
}

bool in_bounds(const Joints& joints) noexcept {
  return joints.count <= Joints::kMost && std::ranges::all_of(joints.angle, bounded) &&
         std::ranges::all_of(joints.velocity, bounded);
}

bool is_finite(const RemoteTorque& torque) noexcept {
  if (!torque.torque.allFinite()) return false;
  if (!torque.model) return true;
  const Quat& at = torque.model->at;
  return torque.model->stiffness.allFinite() && std::isfinite(at.w) && std::isfinite(at.x) && std::isfinite(at.y) &&
         std::isfinite(at.z);
}

}  // namespace

bool in_bounds(const ForceCommand& command) noexcept {
  return all_bounded(command.force) && (!command.model || in_bounds(*command.model)) &&
         (!command.error || (bounded(*command.error) && *command.error >= 0)) &&
         (!command.torque || in_bounds(*command.torque)) && (!command.grip_force || bounded(*command.grip_force));
}

bool is_receivable(const ForceCommand& command) noexcept {
  return command.sequence > 0 && in_bounds(command) && command.valid_for > Duration::zero() &&
         command.valid_for <= limits::kMaxValidFor && command.device < limits::kMaxDevices &&
         command.channel < limits::kMaxChannels && command.way <= limits::kMaxWays;
}

bool in_bounds(const DeviceState& state) noexcept {
  const auto is_time = [](Duration since) { return since >= -limits::kMaxTime && since <= limits::kMaxTime; };
  const auto fits = [](const auto& vector) { return !vector || all_bounded(*vector); };
  const bool unlimited = state.permitted_force == std::numeric_limits<double>::infinity();
  return is_time(state.sampled.time_since_epoch()) && all_bounded(state.position) && all_bounded(state.velocity) &&
         all_bounded(state.force_applied) && bounded(state.energy) && (unlimited || bounded(state.permitted_force)) &&
         state.permitted_force >= 0 && is_time(state.force_age) && state.force_age >= Duration::zero() &&
         state.mode >= Mode::kIdle && state.mode <= Mode::kFault && state.device < limits::kMaxDevices &&
         state.channel < limits::kMaxChannels && fits(state.force_wanted) && fits(state.stiffness_wanted) &&
         (!state.turning ||
          (is_rotation(state.turning->orientation) && all_bounded(state.turning->angular_velocity))) &&
         fits(state.torque_applied) &&
         (!state.grip || (bounded(state.grip->opening) && bounded(state.grip->velocity))) &&
         (!state.grip_applied || bounded(*state.grip_applied)) && fits(state.hand_force) &&
         (!state.joints || in_bounds(*state.joints));
}

bool in_bounds(const SetOutput& wanted) noexcept {
  if (wanted.output >= limits::kMaxOutputs) return false;
  if (const auto* const lamp = std::get_if<LampColour>(&wanted.setting)) return lamp->rgb <= 0xFFFFFF;
  const Vibration& pulse = std::get<Vibration>(wanted.setting);
  const bool own = pulse.frequency == 0;
  return pulse.amplitude >= 0 && pulse.amplitude <= 1 && pulse.duration >= Duration::zero() &&
         pulse.duration <= limits::kMaxVibration &&
         (own || (pulse.frequency >= limits::kMinVibrationHz && pulse.frequency <= limits::kMaxVibrationHz));
}

bool in_bounds(const SetScale& wanted) noexcept {
  const auto possible = [](double scale) { return scale >= 0.01 && scale <= 100; };
  return possible(wanted.position_scale) && possible(wanted.force_scale);
}

bool in_bounds(const SetShare& wanted) noexcept { return wanted.share >= 0 && wanted.share <= 1; }

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
  if (!all_bounded(command.force)) return "the force is beyond 1e12 N";
  if (command.torque && !command.torque->torque.allFinite()) return "the torque is not finite (NaN or infinity)";
  if (command.torque && !all_bounded(command.torque->torque)) return "the torque is beyond 1e12 N·m";
  if (command.torque && !in_bounds(*command.torque)) {
    return "its rotation model has a number beyond its bound (WIRE.md), or its orientation is not of length 1";
  }
  if (command.grip_force && !bounded(*command.grip_force)) return "the grip force is not finite, or beyond 1e12 N";
  return "its stiffness, radius, contact or error is not finite, or out of the bounds of WIRE.md";
}

}  // namespace tendon
