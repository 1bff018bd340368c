// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

/// What a client takes from its machine: the time and random numbers. Everything else is told both.

/// CLOCK_MONOTONIC.
///
/// Thread-safe.
LocalTime read_clock();

/// 32 bytes of the system's random numbers, for one handshake's keys. Throws std::runtime_error when it gives none.
///
/// Thread-safe.
Seed seed_from_system();

}  // namespace tendon
