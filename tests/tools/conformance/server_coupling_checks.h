// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// What a controller may not ask that has named neither "teleoperation" nor "outputs". `id`: its next request.
void check_unasked(ServerGuest& guest, Conversation& controller, std::uint32_t id);

/// It names all that check_coupling() asks about.
pb::Hello with_coupling(pb::Hello hello);

/// Outputs, and the coupling of device 0: with Options::follower it is a follower that fits a leader of
/// position-position, 1000 N/m, 4 N·s/m at each end and none between, adapted to the delay, with a purse; scales 1, no
/// rotation, all axes.
/// `id`: the controller's next request.
void check_coupling(ServerGuest& guest, ServerGuest::Session& controller, std::uint32_t id);

}  // namespace tendon::conformance
