// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// Checks requests of a controller that has named neither "teleoperation" nor "outputs". `id`: its next request.
void check_unasked(ServerGuest& guest, Conversation& controller, std::uint32_t id);

pb::Hello with_coupling(pb::Hello hello);

/// Checks outputs and the coupling of device 0. With Options::follower the device is a follower for a leader with
/// position-position coupling, 1000 N/m, 4 N·s/m at each end and none between, adaptation to the delay, and an energy
/// tank; scales 1, no rotation, all axes. `id`: the controller's next request.
void check_coupling(ServerGuest& guest, ServerGuest::Session& controller, std::uint32_t id);

}  // namespace tendon::conformance
