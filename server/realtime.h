// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace tendon {

/// Below the kernel's own watchdog and migration threads (99) and above ordinary IRQ threads (50).
inline constexpr int kHapticPriority = 70;

/// Asks the kernel to treat the calling thread as a haptic thread: SCHED_FIFO, no timer slack, memory
/// locked, stack touched beforehand. Returns a plain sentence for each wish that was refused (with what
/// it would take to be granted); the thread runs all the same, later now and then.
///
/// `priority`: 1…99.
std::vector<std::string> enter_realtime(int priority);

/// A network or log thread: no timer slack only.
void enter_punctual();

}  // namespace tendon
