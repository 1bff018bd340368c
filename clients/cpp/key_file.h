// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocol/secrets/client_key.h"

namespace tendon {

/// Reads a key file written by `tendond keygen`. Throws std::runtime_error, "FILE: what is wrong", if the file is
/// unreadable, not a regular file, readable by other users, or malformed, or if the key is weak.
ClientKey read_client_key(const std::string& file);

}  // namespace tendon
