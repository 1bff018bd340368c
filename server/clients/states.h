// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/messages.h"
#include "server/clients/served_client.h"

namespace tendon {

/// Sends a state unless the previous one is too recent for the client's rate, or the client is the peer of a coupling.
/// Removes fields that were not requested or do not fit into a frame. Returns true if the client can predict the state,
/// in which case it is not sent (StateDeadband).
bool publish_state(ServedClient& client, Subscription& subscription, const DeviceState& state);

}  // namespace tendon
