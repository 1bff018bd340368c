// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace tendon {

/// Random bytes from the system, good enough for keys; at most 256 in one call. Throws std::system_error when
/// it gives none.
void fill_random(std::span<std::byte> bytes);

}  // namespace tendon
