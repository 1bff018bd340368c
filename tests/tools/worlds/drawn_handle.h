// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "clients/cpp/force_client.h"
#include "tests/tools/worlds/drawn_world.h"

namespace tendon::simulation {

std::string number(double value);

/// Rotation may be passive or have motors; only laws with a HandlePort have motors. The true friction is at least 2 %
/// above the limiter's value (see HandlePort).
void draw_handle(Dice dice, DrawnWorld& world, const Sabotage& sabotage);

std::string describe_handle(const DrawnWorld& world);

/// Torque, angular stiffness and grip force of the device's motors, with the same errors as the force.
void answer_handle(const DrawnClient& client, Dice& dice, const DeviceState& hand, Touch& touch);

}  // namespace tendon::simulation
