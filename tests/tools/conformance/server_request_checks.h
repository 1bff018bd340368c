// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

void check_requests(ServerGuest& guest, Conversation& talk);

}  // namespace tendon::conformance
