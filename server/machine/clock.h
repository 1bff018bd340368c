// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// The real clock, CLOCK_MONOTONIC: the only place in the server where time is taken. Each thread reads it
/// once per turn and passes it on; UdpLink reads it for each datagram.
///
/// Thread-safe, realtime-safe.
namespace clock {

LocalTime now() noexcept;

/// Sleeps until `deadline` on the absolute time line, so that errors do not add up.
void sleep_until(LocalTime deadline) noexcept;

/// Processor time of the calling thread since it began.
Duration processor_time() noexcept;

/// Unix time − local time, at this moment: for recordings, whose readers know calendars.
Duration unix_offset() noexcept;

}  // namespace clock
}  // namespace tendon
