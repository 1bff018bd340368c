// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/messages.h"
#include "server/guests/guest.h"

namespace tendon {

/// Sends a state of a device to the guest. The state is not sent if the previous state is too recent for the guest's
/// rate, or if the guest is the peer of a coupling. All fields that were not requested by the guest or do not fit into
/// a frame are removed. Returns true if the guest can predict the state, in which case it is not sent (StateDeadband).
bool tell_state(Guest& guest, View& view, const DeviceState& state);

}  // namespace tendon
