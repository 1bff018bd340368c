// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/touch.h"

namespace tendon {

ForceCommand to_command(const Touch& touch, const DeviceState& hand) {
  ForceCommand command;
  command.based_on_tick = hand.tick;
  command.force = touch.force;
  command.topology_changed = touch.topology_changed;
  command.error = touch.error;
  command.way = touch.way;
  if (touch.stiffness || touch.contact) {
    command.model = LocalModel{.at = hand.position,
                               .stiffness = touch.stiffness.value_or(Mat3(Mat3::Zero())),
                               .valid_radius = touch.valid_radius,
                               .contact = touch.contact};
  }
  command.grip_force = touch.grip_force;
  if (!touch.torque && !touch.angular_stiffness) return command;
  RemoteTorque& torque = command.torque.emplace();
  torque.torque = touch.torque.value_or(Vec3(Vec3::Zero()));
  if (touch.angular_stiffness && hand.turning) {
    torque.model = RotationModel{.at = hand.turning->orientation, .stiffness = *touch.angular_stiffness};
  }
  return command;
}

Touch to_touch(const ForceCommand& command) {
  Touch touch = command.force;
  touch.topology_changed = command.topology_changed;
  touch.error = command.error;
  touch.way = command.way;
  touch.is_truth = command.field > 0;
  if (command.model) {
    touch.stiffness = command.model->stiffness;
    touch.valid_radius = command.model->valid_radius;
    touch.contact = command.model->contact;
  }
  touch.grip_force = command.grip_force;
  if (command.torque) {
    touch.torque = command.torque->torque;
    if (command.torque->model) touch.angular_stiffness = command.torque->model->stiffness;
  }
  return touch;
}

}  // namespace tendon
