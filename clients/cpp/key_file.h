// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocol/secrets/client_key.h"

namespace tendon {

/// The key in this file, as `tendond keygen` writes it. Throws std::runtime_error, "FILE: what is wrong": it
/// cannot be read, it is a folder or a pipe, others may read it, it is no key file, or the key is weak.
ClientKey read_client_key(const std::string& file);

}  // namespace tendon
