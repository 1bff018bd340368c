// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <istream>
#include <string>

#include "core/identification/ramp_run.h"
#include "tests/tools/lab/identify/freedom.h"

namespace tendon::lab {

/// One run of the friction experiment from a CSV file: a header line that names the columns `t_s` and the two of
/// `freedom` (`x_m` and `force_n`, or `angle_rad` and `torque_nm`; in any order, others are ignored), then one sample
/// per line; commas, `.` as decimal point, no quotes.
///
/// Throws std::runtime_error "file:line: what was expected, what was found": no header, a column missing or twice, a
/// row with too few cells or one that is not a finite number, time that does not increase, more than 4 million rows.
/// Blank lines are skipped.
RampRun read_ramp_csv(std::istream& in, const std::string& name, Freedom freedom = Freedom::kMovement);

/// The same from a file; throws std::runtime_error when it cannot be opened.
RampRun load_ramp_csv(const std::filesystem::path& file, Freedom freedom = Freedom::kMovement);

}  // namespace tendon::lab
