// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <istream>
#include <string>

#include "core/identification/ramp_run.h"
#include "tests/tools/lab/identify/freedom.h"

namespace tendon::lab {

/// Reads one run with TableReader. The header names the columns `t_s` and the two of `freedom` (`x_m` and `force_n`, or
/// `angle_rad` and `torque_nm`) in any order. Other columns are ignored, other units are converted. Throws
/// std::runtime_error with file and line if TableReader rejects the file, a column is missing, time does not increase,
/// or there are more than 4 million rows.
RampRun read_ramp_csv(std::istream& in, const std::string& name, Freedom freedom = Freedom::kMovement);

/// Reads the run from a file. Also throws std::runtime_error if it cannot be opened.
RampRun load_ramp_csv(const std::filesystem::path& file, Freedom freedom = Freedom::kMovement);

}  // namespace tendon::lab
