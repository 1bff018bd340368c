// SPDX-License-Identifier: Apache-2.0
#include "clients/c/convert.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>

namespace tendon {
namespace {

void put(const Vec3& from, double (&to)[3]) noexcept { std::copy_n(from.data(), 3, to); }

void put(const Quat& from, double (&to)[4]) noexcept {
  to[0] = from.w;
  to[1] = from.x;
  to[2] = from.y;
  to[3] = from.z;
}

/// The last byte of `to` remains 0.
template <std::size_t kSize>
void put(const std::string& from, char (&to)[kSize]) noexcept {
  std::copy_n(from.data(), std::min(from.size(), kSize - 1), to);
}

Vec3 vector(const double (&from)[3]) noexcept { return Vec3(from[0], from[1], from[2]); }

Mat3 matrix(const double (&from)[9]) noexcept {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(from);
}

}  // namespace

tendon_state to_c(const DeviceState& hand) noexcept {
  tendon_state state{};
  state.tick = hand.tick;
  state.sampled_ns = hand.sampled.time_since_epoch().count();
  put(hand.position, state.position);
  put(hand.velocity, state.velocity);
  put(hand.force_applied, state.force_applied);
  state.reasons = hand.reasons;
  state.buttons = hand.buttons;
  if (hand.turning) {
    state.has |= TENDON_STATE_TURNING;
    put(hand.turning->orientation, state.orientation);
    put(hand.turning->angular_velocity, state.angular_velocity);
  }
  if (hand.torque_applied) {
    state.has |= TENDON_STATE_TORQUE;
    put(*hand.torque_applied, state.torque_applied);
  }
  if (hand.grip) {
    state.has |= TENDON_STATE_GRIP;
    state.grip = hand.grip->opening;
    state.grip_velocity = hand.grip->velocity;
  }
  if (hand.grip_applied) {
    state.has |= TENDON_STATE_GRIP_FORCE;
    state.grip_applied = *hand.grip_applied;
  }
  if (hand.hand_force) {
    state.has |= TENDON_STATE_HAND_FORCE;
    put(*hand.hand_force, state.hand_force);
  }
  return state;
}

tendon_description to_c(const DeviceDescription& device, const HandleDescription* handle) noexcept {
  tendon_description out{};
  put(device.name, out.device);
  put(device.model, out.model);
  out.position_axes = device.position_dof;
  out.force_axes = device.force_dof;
  out.loop_hz = device.loop_hz;
  if (device.workspace) {
    out.has |= TENDON_DESCRIPTION_WORKSPACE;
    put(device.workspace->min, out.workspace_min);
    put(device.workspace->max, out.workspace_max);
  }
  out.max_force = device.max_force;
  out.continuous_force = device.continuous_force;
  out.max_stiffness = device.max_stiffness;
  out.position_resolution = device.position_resolution;
  if (handle == nullptr) return out;
  out.buttons = static_cast<std::uint32_t>(handle->buttons.size());
  if (handle->operator_from_device) {
    out.has |= TENDON_DESCRIPTION_FRAME;
    put(*handle->operator_from_device, out.operator_from_device);
  }
  if (handle->orientation_measured) out.has |= TENDON_DESCRIPTION_TURNING;
  if (handle->gripper_open) {
    out.has |= TENDON_DESCRIPTION_GRIPPER;
    out.gripper_open = *handle->gripper_open;
  }
  out.max_torque = handle->max_torque;
  out.max_gripper_force = handle->max_gripper_force;
  return out;
}

Touch to_touch(const tendon_force& force) noexcept {
  const auto has = [&](std::uint32_t bit) { return (force.has & bit) != 0; };
  Touch touch = vector(force.force);
  if (has(TENDON_FORCE_STIFFNESS)) touch.stiffness = matrix(force.stiffness);
  if (has(TENDON_FORCE_RADIUS)) touch.valid_radius = force.valid_radius;
  if (has(TENDON_FORCE_CONTACT)) {
    touch.contact = Contact{.normal = vector(force.normal), .gap = force.gap, .table = {}};
  }
  if (has(TENDON_FORCE_TORQUE)) touch.torque = vector(force.torque);
  if (has(TENDON_FORCE_ANGULAR_STIFFNESS)) touch.angular_stiffness = matrix(force.angular_stiffness);
  if (has(TENDON_FORCE_GRIP)) touch.grip_force = force.grip_force;
  if (has(TENDON_FORCE_VALID_FOR)) touch.valid_for = Duration(force.valid_for_ns);
  touch.topology_changed = has(TENDON_FORCE_TOPOLOGY);
  return touch;
}

}  // namespace tendon
