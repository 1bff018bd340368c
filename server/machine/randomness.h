// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace tendon {

/// Fills the buffer, which must not exceed 256 bytes, with random bytes from the system. They can be used for keys.
/// Throws std::system_error if this is not possible.
void fill_random(std::span<std::byte> bytes);

}  // namespace tendon
