// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/messages.h"
#include "server/guests/guest.h"

namespace tendon {

/// Sends a state of the device of `view` to the guest. It is not sent if the last state is too recent for the guest's
/// rate, or if the guest is the other end of a coupling. The function removes the fields that the guest did not ask for
/// and the fields that do not fit into a frame. Returns true if the guest can predict the state (StateDeadband).
bool tell_state(Guest& guest, View& view, const DeviceState& state);

}  // namespace tendon
