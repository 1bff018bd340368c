// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace tendon::soak {

/// A process's memory, files and threads at one moment, from /proc/PID.
struct VitalSigns {
  std::size_t resident = 0;  ///< bytes in memory
  std::size_t files = 0;     ///< open descriptors
  std::size_t threads = 0;
};

/// Empty when there is no such process any more.
std::optional<VitalSigns> vital_signs(pid_t process);

/// Checks that a process stays flat over equal spans of a run; the first fifth is warm-up.
///
///     most of the last two fifths ≤ most of the second and third + `growth`
///
/// Returns a sentence naming the first that grows; empty when none does or with fewer than ten samples.
std::optional<std::string> not_flat(const std::string& name, const std::vector<VitalSigns>& looks,
                                    const VitalSigns& growth);

}  // namespace tendon::soak
