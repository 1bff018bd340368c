// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace tendon::soak {

/// What a process has of the machine at one moment, as /proc/PID says.
struct VitalSigns {
  std::size_t resident = 0;  ///< bytes in memory
  std::size_t files = 0;     ///< open descriptors
  std::size_t threads = 0;
};

/// Empty when there is no such process any more.
std::optional<VitalSigns> vital_signs(pid_t process);

/// What must stay flat does: looked at over equally long spans of a run, of which the first fifth is for getting warm.
///
///     most of the last two fifths ≤ most of the second and third + `growth`
///
/// A sentence when one does not; empty when all do, or when there are fewer than ten looks.
std::optional<std::string> not_flat(const std::string& name, const std::vector<VitalSigns>& looks,
                                    const VitalSigns& growth);

}  // namespace tendon::soak
