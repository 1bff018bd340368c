// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// The real clock, CLOCK_MONOTONIC. The server must not read the time anywhere else. Each thread calls now() once per
/// turn and passes the result on. UdpLink also reads the clock for each datagram.
///
/// Thread-safe: yes. Realtime-safe: yes.
namespace clock {

LocalTime now() noexcept;

/// Sleeps until an absolute time to avoid the accumulation of errors.
void sleep_until(LocalTime deadline) noexcept;

/// Returns the processor time that has been used by the calling thread.
Duration processor_time() noexcept;

/// Returns the difference between Unix time and local time. This is used to convert times in recordings to dates.
Duration unix_offset() noexcept;

}  // namespace clock
}  // namespace tendon
