// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

/// A shard has had two results that differ: in which units, and is it the program or a node?
///
/// The results themselves tell the units, even when what happened never happens again: by their lines, or by their
/// digests when one unit differs. Where several differ that have no lines, the program is run again here: all of the
/// shard and then halves, each twice, until two runs differ in one unit. Units that are known are then run by themselves,
/// again and again. `out` is told all of it. True when a unit is named.
/// Throws std::invalid_argument when the shard has not had two results, std::runtime_error when the program fails.
bool bisect(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out);

}  // namespace tendon::sweep
