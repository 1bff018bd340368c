// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

/// Finds the units that differ between two results of a shard, and whether the cause is the program or a node.
///
/// First compares the two stored results: their lines, or their digests if only one unit differs. If there are several
/// units without lines, it runs the program for the whole shard and then for halves of it. Each half is run twice,
/// until two runs are different in one unit. Then, each of these units is run alone several times. Writes a report to
/// `out`. Returns true if a unit was identified. Throws std::invalid_argument if the shard does not have two results,
/// std::runtime_error if the program fails.
bool bisect(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out);

}  // namespace tendon::sweep
