// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <istream>
#include <string>

#include "core/identification/ramp_run.h"
#include "tests/tools/lab/identify/freedom.h"

namespace tendon::lab {

/// Reads one run of the friction experiment with TableReader. The header names the column `t_s` and the two columns of
/// `freedom` (`x_m` and `force_n`, or `angle_rad` and `torque_nm`). Their order is free, other columns are ignored, and
/// other units are converted.
///
/// It throws std::runtime_error with file and line if TableReader refuses the file, if a column is missing, if the time
/// does not increase, or if there are more than 4 million rows.
RampRun read_ramp_csv(std::istream& in, const std::string& name, Freedom freedom = Freedom::kMovement);

/// The same from a file; throws std::runtime_error when it cannot be opened.
RampRun load_ramp_csv(const std::filesystem::path& file, Freedom freedom = Freedom::kMovement);

}  // namespace tendon::lab
