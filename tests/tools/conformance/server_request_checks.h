// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// Requests of an open session: their order, their answers, and each once only. Ends with the server's keep-alive.
void check_requests(ServerGuest& guest, Conversation& talk);

}  // namespace tendon::conformance
