// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

LocalTime read_clock();      ///< reads CLOCK_MONOTONIC; thread-safe
Duration read_unix_clock();  ///< reads CLOCK_REALTIME, the time since 1970; thread-safe

bool has_one_processor();  ///< whether the affinity mask of this process contains only one processor

/// Reduces the timer slack of the calling thread to its minimum during its lifetime. By default, Linux may wake the
/// thread up to 50 µs late. Must be constructed and destroyed on the same thread.
class Punctual {
 public:
  Punctual() noexcept;
  ~Punctual();
  Punctual(const Punctual&) = delete;
  Punctual& operator=(const Punctual&) = delete;

 private:
  int slack_ns_;  ///< previous timer slack
};

/// Returns 32 random bytes of the operating system for one handshake, or throws std::runtime_error. Thread-safe.
Seed seed_from_system();

}  // namespace tendon
