// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace tendon::soak {

/// Memory, files and threads of a process, from /proc/PID.
struct VitalSigns {
  std::size_t resident = 0;
  std::size_t files = 0;  ///< open descriptors
  std::size_t threads = 0;
};

/// Returns nullopt if the process does not exist.
std::optional<VitalSigns> vital_signs(pid_t process);

/// The first fifth of the samples is warm-up; flat means
///
///     max(last two fifths) ≤ max(second and third fifth) + `growth`
///
/// Returns a sentence about the first value that grows, or nullopt if none does or if there are fewer than ten samples.
std::optional<std::string> not_flat(const std::string& name, const std::vector<VitalSigns>& looks,
                                    const VitalSigns& growth);

}  // namespace tendon::soak
