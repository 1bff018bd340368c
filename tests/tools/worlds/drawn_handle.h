// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "clients/cpp/force_client.h"
#include "tests/tools/worlds/drawn_world.h"

namespace tendon::simulation {

/// In four digits, for people.
std::string number(double value);

/// Gives the device of `world` what a handle can have beyond a position: it turns, with motors or as the hand turns it,
/// it grips, and its buttons are pressed. Only a device whose law is one of HandlePort's has such motors. True friction
/// is above what the limiter is told by 2 % or more (HandlePort says why).
void draw_handle(Dice dice, DrawnWorld& world, const Sabotage& sabotage);

/// What `world` has of it, for people; empty when it is a point.
std::string describe_handle(const DrawnWorld& world);

/// Adds to an engine's answer a torque, an angular stiffness and a grip force, where the device has such motors: as
/// right or as wrong as its force.
void answer_handle(const DrawnClient& client, Dice& dice, const DeviceState& hand, Touch& touch);

}  // namespace tendon::simulation
