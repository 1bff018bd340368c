// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

/// What a client takes from its machine: the time, random numbers, and to be woken in time. Everything else is told
/// both.

/// CLOCK_MONOTONIC.
///
/// Thread-safe.
LocalTime read_clock();

/// Whether this process may run on one processor only.
bool has_one_processor();

/// While it lives, the calling thread is woken from a sleep when it is over, and not up to 50 µs later as the kernel
/// allows itself by default (timer slack). Afterwards as before. To be made and destroyed on one thread.
class Punctual {
 public:
  Punctual() noexcept;
  ~Punctual();
  Punctual(const Punctual&) = delete;
  Punctual& operator=(const Punctual&) = delete;

 private:
  int slack_ns_;  ///< as it was
};

/// 32 bytes of the system's random numbers, for one handshake's keys. Throws std::runtime_error when it gives none.
///
/// Thread-safe.
Seed seed_from_system();

}  // namespace tendon
