// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "tests/tools/sweep/plan.h"
#include "tests/tools/sweep/results.h"

namespace tendon::sweep {

/// Throws std::runtime_error, with the correction, if this node's program or arithmetic differs from the plan's.
/// `self`: the file of tendon-sweep, which is started like the program to get its fingerprint.
void expect_as_planned(const Plan& plan, const std::filesystem::path& self);

Fingerprint fingerprint_of(Arithmetic arithmetic, const std::filesystem::path& self);

std::string text_of(const Units& units);

/// Throws std::runtime_error with the end of standard error if the program fails.
std::string output_of(const Plan& plan, const Units& units);

/// Stores the result, or the end of standard error, and writes a line about the outcome to `out`. Returns true if the
/// shard has a result now, from this process or another. Thread-safe: yes, except for `out`.
bool run_shard(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out);

/// Those without a result, with `jobs` processes at a time. Returns true if all have results. `progress`: also prints
/// counts to standard error.
bool run_shards(const std::filesystem::path& folder, const Plan& plan, const std::vector<std::uint64_t>& shards,
                unsigned jobs, bool progress, std::ostream& out);

/// Writes FOLDER/merged.jsonl, which equals the output of one process over all units. Then runs PROGRAM ARGUMENTS
/// --from merged.jsonl, if it has this option, and returns its exit status: 1 if an invariant was violated. Throws
/// std::runtime_error if a shard has no result or two different ones.
int merge(const std::filesystem::path& folder, const Plan& plan, std::ostream& out);

}  // namespace tendon::sweep
