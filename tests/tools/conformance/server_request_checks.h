// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// Checks the order, the answers and the single execution of requests.
void check_requests(ServerGuest& guest, Conversation& talk);

}  // namespace tendon::conformance
