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

Duration processor_time() noexcept;

/// Returns Unix time − local time.
Duration unix_offset() noexcept;

}  // namespace clock
}  // namespace tendon
