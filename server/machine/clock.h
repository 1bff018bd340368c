// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// The real clock, CLOCK_MONOTONIC. The server must not read the time anywhere else. Each thread calls now() once per
/// turn and passes the result on. UdpLink also reads the clock for each datagram. Thread-safe: yes. Realtime-safe: yes.
namespace clock {

LocalTime now() noexcept;

void sleep_until(LocalTime deadline) noexcept;  ///< absolute, so that errors do not accumulate

Duration processor_time() noexcept;

Duration unix_time() noexcept;  ///< since 1970, CLOCK_REALTIME

Duration unix_offset() noexcept;  ///< Unix time − local time

}  // namespace clock
}  // namespace tendon
