// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon::injector {

/// CLOCK_MONOTONIC, the only clock of the proxy. Classes below the driver receive the time as an argument.
///
/// Thread-safe: yes.
LocalTime monotonic_now() noexcept;

/// Converts the kernel's datagram time stamps, which are Unix time, to local time.
struct ClockPair {
  LocalTime now;
  Duration unix_offset;  ///< Unix time − local time
};

/// Reads both clocks close enough together that an interruption cannot spoil the offset.
///
/// Thread-safe: yes.
ClockPair read_both_clocks() noexcept;

}  // namespace tendon::injector
