// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/server_guest.h"

// The name of each function contains the name of the check.

namespace tendon::conformance {

void check_retry(ServerGuest& guest);
void check_bad_hellos(ServerGuest& guest);
void check_bad_bodies(ServerGuest& guest);
void check_cookie(ServerGuest& guest);
void check_versions(ServerGuest& guest);
void check_features(ServerGuest& guest);
void check_keys(ServerGuest& guest);
void check_half_open(ServerGuest& guest);
void check_stray_data(ServerGuest& guest);
void check_hello_limit(ServerGuest& guest);
void check_answer_again(ServerGuest& guest, ServerGuest::Session& session);
void check_second_controller(ServerGuest& guest);

}  // namespace tendon::conformance
