// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon::injector {

/// CLOCK_MONOTONIC: the only clock of the proxy. Everything below the driver is told the time.
///
/// Thread-safe.
LocalTime monotonic_now() noexcept;

/// The calendar's clock beside our own: the kernel stamps datagrams with the former.
struct ClockPair {
  LocalTime now;
  Duration unix_offset;  ///< Unix time − local time
};

/// Both clocks, read so close to each other that being interrupted in between cannot spoil the offset.
///
/// Thread-safe.
ClockPair read_both_clocks() noexcept;

}  // namespace tendon::injector
