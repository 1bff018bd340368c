// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon::injector {

/// CLOCK_MONOTONIC, the only clock of the proxy. Thread-safe: yes.
LocalTime monotonic_now() noexcept;

/// Converts the kernel's datagram time stamps (Unix time) to local time.
struct ClockPair {
  LocalTime now;
  Duration unix_offset;  ///< Unix time − local time
};

/// An interruption between the two readings cannot spoil the offset. Thread-safe: yes.
ClockPair read_both_clocks() noexcept;

}  // namespace tendon::injector
