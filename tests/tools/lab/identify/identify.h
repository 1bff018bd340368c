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

/// What `tendon-identify` is asked for: recorded runs, or a simulated device in their place.
struct IdentifyOptions {
  std::vector<std::filesystem::path> files = {};  ///< CSV, one run each
  /// Axis and pose, once for each file in order. Left out: all runs are of one place.
  std::vector<std::string> places = {};
  std::optional<std::string> profile = {};  ///< simulate the device profile of that name
  Freedom freedom = Freedom::kMovement;
  /// Simulate a device with that friction: a movement or fingers of 75 g and 30 µm, a rotation of 10⁻⁴ kg·m² and 0.1
  /// mrad.
  std::optional<Friction> simulated_friction = {};
  std::uint64_t seed = 1;                   ///< of the simulation
  std::optional<double> mass = {};          ///< kg or kg·m²; left out: fitted, or that of the simulated device
  std::optional<double> encoder_step = {};  ///< m or rad; left out: 30 µm, 0.1 mrad, or as simulated
  bool json = false;
  Part part{};  ///< its units are the runs, in their order: the files, or 30 that are simulated
};

/// Identifies the friction and writes the result to `out`. The result is a table, the trusted method and the reason, and
/// a fragment of a scene with the lower bounds. If neither method is trusted, there is no fragment. With `json`, the
/// result is one line for each run and one more line.
///
/// Outside a sweep, it writes nothing before the whole result is known. It throws std::invalid_argument if the options
/// are wrong, before it reads a file. It throws std::runtime_error with the name of the file if it cannot read or use a
/// run. It also throws if the travel, the mass or the friction is beyond the limits in HandleBounds, and the message names
/// the unit that the user probably meant.
void identify(const IdentifyOptions& options, std::ostream& out);

}  // namespace tendon::lab
