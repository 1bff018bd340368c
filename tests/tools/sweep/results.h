// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

// The folder holds the complete state; there is no coordinator, heartbeat or database. A result is written to a
// temporary file, synced, and hard-linked to its final name. The link fails if a result exists, and then the two are
// compared. A shard that runs twice (a retry, a partition, two users) is therefore harmless.
//
//     FOLDER/plan.json
//     FOLDER/done/000017.json       output of the program
//     FOLDER/done/000017.differs    a later output that is different
//     FOLDER/failed/000017.log      end of standard error of the last failed run
//     FOLDER/merged.jsonl           written by `merge`

enum class Kept : std::uint8_t {
  kNew,
  kSame,   ///< an identical file exists
  kOther,  ///< a different file exists and has not been changed
};

/// Creates `file` with this text atomically and never overwrites one. If the file is visible, it has been synced.
Kept keep(const std::filesystem::path& file, std::string_view text);

/// Returns the whole file. Throws std::runtime_error naming it.
std::string contents_of(const std::filesystem::path& file);

/// Stores a shard's output as its result. If this returns kOther, the output was stored as .differs.
Kept keep_result(const std::filesystem::path& folder, std::uint64_t shard, std::string_view text);

/// Throws std::runtime_error if the file is not a result of this shard.
std::optional<std::string> result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard);

std::optional<std::string> other_result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard);

std::string lines_of(std::string_view output, std::uint64_t unit);

/// By their lines, or by the digests if all lines are the same, which identify a single unit. Empty if several such
/// units have no lines, or if only the end line is different.
std::vector<std::uint64_t> differing_units(std::string_view one, std::string_view other, const Units& units);

/// "unit 13", "units 13, 17", "several units", "no unit, but in their ends".
std::string difference(std::string_view one, std::string_view other, const Units& units);

/// Throws std::invalid_argument unless `output` is the complete output of a run of these units.
ShardEnd end_of(std::string_view output, const Units& units);

struct Status {
  std::uint64_t shards = 0;
  std::uint64_t done = 0;
  std::vector<std::uint64_t> missing{};
  std::vector<std::uint64_t> differing{};  ///< shards with two different results
  std::vector<std::uint64_t> failed{};     ///< shards without a result whose last run failed
};
Status status_of(const std::filesystem::path& folder, const Plan& plan);

/// Formats as Slurm's --array expects: "0-3,17". Empty for no numbers.
std::string ranges(const std::vector<std::uint64_t>& numbers);

std::filesystem::path result_file(const std::filesystem::path& folder, std::uint64_t shard);
std::filesystem::path failure_file(const std::filesystem::path& folder, std::uint64_t shard);

}  // namespace tendon::sweep
