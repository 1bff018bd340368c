// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

/// Finds the units that differ between two results of a shard, and whether the cause is the program or a node. First
/// compares the stored lines, or the digests if only one unit differs. Otherwise runs the whole shard and then halves
/// of it, each twice, until two runs differ in one unit. Then runs each of these units alone several times. Returns
/// true if a unit was identified. Throws std::invalid_argument if the shard does not have two results,
/// std::runtime_error if the program fails.
bool bisect(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out);

}  // namespace tendon::sweep
