// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/ledger/friction.h"
#include "tests/support/swept_work.h"
#include "tests/tools/lab/identify/freedom.h"

namespace tendon::lab {

struct IdentifyOptions {
  std::vector<std::filesystem::path> files = {};  ///< CSV, one run each
  /// Axis and pose, one per file in order. Empty: all runs are at one place.
  std::vector<std::string> places = {};
  std::optional<std::string> profile = {};  ///< name of the device profile to simulate
  Freedom freedom = Freedom::kMovement;
  /// Simulates this friction: a translation or gripper of 75 g and 30 µm, or a rotation of 10⁻⁴ kg·m² and 0.1 mrad.
  std::optional<Friction> simulated_friction = {};
  std::uint64_t seed = 1;                   ///< of the simulation
  std::optional<double> mass = {};          ///< kg or kg·m²; empty: fitted, or that of the simulated device
  std::optional<double> encoder_step = {};  ///< m or rad. The default is 30 µm, 0.1 mrad, or the simulated value.
  bool json = false;
  Part part{};  ///< the units are the runs, which are the files or 30 simulated runs
};

/// Writes a table, the trusted method and the reason, and a fragment of a scene with the lower bounds, unless neither
/// method is trusted. `json`: one line for each run and one more.
///
/// Writes nothing until the whole result is known, except in a sweep. Throws std::invalid_argument for invalid options
/// before reading a file. Throws std::runtime_error with the file name if a run cannot be read or used, and also if
/// travel, mass or friction is outside HandleBounds; the message suggests the unit that was probably used.
void identify(const IdentifyOptions& options, std::ostream& out);

}  // namespace tendon::lab
