// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace tendon {

/// Fills up to 256 bytes with cryptographically secure random numbers. Throws std::system_error on failure.
void fill_random(std::span<std::byte> bytes);

}  // namespace tendon
