// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string_view>
#include <vector>

#include "core/control/preset.h"
#include "core/teleoperation/methods/coupling_method.h"
#include "tests/support/swept_work.h"

namespace tendon::lab {

struct MatrixOptions {
  std::uint64_t seed = 1;                        ///< of the networks
  std::optional<Preset> preset = Preset::kFeel;  ///< of the limiters; empty: AOL+ without parts
  Part part{};                                   ///< the units are the rows
};

struct MatrixCase {
  CouplingMethod method = CouplingMethod::kPositionPosition;
  std::string_view devices{};  ///< a profile, or two as leader/follower
  std::string_view network{};  ///< a named network of the injector, or `bursts`
  bool counts = false;
};
std::vector<MatrixCase> matrix_cases();

struct MatrixResult {
  double held = 0;       ///< share of the force of a rigid link in the press; NaN for `rate`, which has no such force
  double drift = 0;      ///< m, change of the offset between the ends in a minute of motion; NaN for `rate`
  double vibration = 0;  ///< m/s rms above 20 Hz of a handle that rests in contact or free, of the worse end
  double energy = 0;     ///< J, the minimum work of both ports together
  bool engaged = false;  ///< until the end; otherwise the coupling was lost, and no other value is valid
};

/// Two devices of devices/simulated/profiles.h with tendond's coupling in virtual time, at 1 kHz. A hand of 400 N/m
/// presses 30 mm at a wall of 500 N/m at 10 mm for 4 s, rests for 3 s, and then moves ± 20 mm at 1 Hz in free space for
/// a minute. Deterministic. Throws std::invalid_argument if a name is unknown.
MatrixResult matrix_result(const MatrixCase& of, std::uint64_t seed, std::optional<Preset> preset);

/// `tendon-lab teleop --matrix`: prints the table as CSV, with progress on stderr.
void teleop_matrix(const MatrixOptions& options, std::ostream& out);

}  // namespace tendon::lab
