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

/// Identifies the friction and writes to `out` a table, which method is trusted and why, and a fragment of a scene with
/// the lower bounds; or one line of JSON for each run and a last one for the result.
///
/// But for a shard of a sweep nothing is written before all is known. Throws std::invalid_argument when the options make
/// no sense, before anything is read; std::runtime_error when a file cannot be read or a run cannot be used, naming the
/// file.
void identify(const IdentifyOptions& options, std::ostream& out);

}  // namespace tendon::lab
