// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "clients/cpp/force_client.h"
#include "tests/tools/worlds/drawn_world.h"

namespace tendon::simulation {

std::string number(double value);

/// Adds rotation, gripper and buttons to the device of `world`. Rotation may be passive or have motors; only laws with
/// a HandlePort have motors. The true friction is at least 2 % above the limiter's value (see HandlePort).
void draw_handle(Dice dice, DrawnWorld& world, const Sabotage& sabotage);

/// Returns an empty string for a point device.
std::string describe_handle(const DrawnWorld& world);

/// Adds torque, angular stiffness and grip force to an engine's answer if the device has these motors, with the same
/// errors as the force.
void answer_handle(const DrawnClient& client, Dice& dice, const DeviceState& hand, Touch& touch);

}  // namespace tendon::simulation
