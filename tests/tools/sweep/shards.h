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

/// Throws std::runtime_error, saying how to make it equal, where this node's program or arithmetic is not the plan's.
/// `self`: the file of tendon-sweep, which tells the arithmetic of a process that is started as the program will be.
void expect_as_planned(const Plan& plan, const std::filesystem::path& self);

/// What a process with this arithmetic computes on this node.
Fingerprint fingerprint_of(Arithmetic arithmetic, const std::filesystem::path& self);

/// "FIRST:COUNT".
std::string text_of(const Units& units);

/// What the program prints of these units. Throws std::runtime_error, with the end of what it complained about, when it
/// does not end well.
std::string output_of(const Plan& plan, const Units& units);

/// Runs one shard and keeps its result, or the end of what it complained about. Says in a line on `out` what became of
/// it. True when the shard is done now, by us or by another. Thread-safe: yes, but for `out`.
bool run_shard(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard, std::ostream& out);

/// Runs these shards with `jobs` processes at a time, but for those that are done. True when all are done.
/// `progress`: also says how many are done, on standard error.
bool run_shards(const std::filesystem::path& folder, const Plan& plan, const std::vector<std::uint64_t>& shards,
                unsigned jobs, bool progress, std::ostream& out);

/// FOLDER/merged.jsonl: what one process would have printed that had run all units; then what the program says to it
/// (PROGRAM ARGUMENTS --from merged.jsonl), where it has such an option. Returns the program's exit status: 1 where a
/// promise was broken. Throws std::runtime_error when a shard is missing, or has differing results.
int merge(const std::filesystem::path& folder, const Plan& plan, std::ostream& out);

}  // namespace tendon::sweep
