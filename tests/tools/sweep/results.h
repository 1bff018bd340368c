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

// The folder is the state: no heartbeat, no database, no coordinator. A result is written under a name of its own,
// synced, and linked to its place; the link fails when a result is there already, and then the two are compared. A shard
// that runs twice (a retry, a partition, two users) is thereby always the same harmless case.
//
//     FOLDER/plan.json
//     FOLDER/done/000017.json       what the program printed
//     FOLDER/done/000017.differs    … and what it printed another time, when that is not the same
//     FOLDER/failed/000017.log      the end of what the program said when it failed last
//     FOLDER/merged.jsonl           of `merge`

enum class Kept : std::uint8_t {
  kNew,
  kSame,   ///< it was there, byte for byte
  kOther,  ///< something else is there, and has been left alone
};

/// Gives `file` this text, all of it or none, and never in place of another. Whoever sees the file sees it synced.
Kept keep(const std::filesystem::path& file, std::string_view text);

/// All of a file. Throws std::runtime_error, naming it.
std::string contents_of(const std::filesystem::path& file);

/// What a shard printed becomes its result. kOther: it is kept beside, as .differs.
Kept keep_result(const std::filesystem::path& folder, std::uint64_t shard, std::string_view text);

/// A shard's result; empty when there is none. Throws std::runtime_error when it is not one of this shard.
std::optional<std::string> result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard);

/// … and the one that differs from it, if it has had two.
std::optional<std::string> other_result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard);

/// The lines of a unit in a program's output; empty when it has none.
std::string lines_of(std::string_view output, std::uint64_t unit);

/// The units in which two outputs of the same units differ: by their lines; where no line differs, the one that the
/// digests tell. Empty when they do not: several units differ, or none and only the end does.
std::vector<std::uint64_t> differing_units(std::string_view one, std::string_view other, const Units& units);

/// Where two outputs of the same units differ, for people: "unit 13", "units 13, 17", "several units", "no unit, but in
/// their ends".
std::string difference(std::string_view one, std::string_view other, const Units& units);

/// Throws std::invalid_argument unless this is the whole output of a program that has run these units.
ShardEnd end_of(std::string_view output, const Units& units);

struct Status {
  std::uint64_t shards = 0;
  std::uint64_t done = 0;
  std::vector<std::uint64_t> missing{};
  std::vector<std::uint64_t> differing{};  ///< of those that are done
  std::vector<std::uint64_t> failed{};     ///< of those that are missing
};
Status status_of(const std::filesystem::path& folder, const Plan& plan);

/// "0-3,17", as Slurm's --array takes it; empty for none.
std::string ranges(const std::vector<std::uint64_t>& numbers);

std::filesystem::path result_file(const std::filesystem::path& folder, std::uint64_t shard);
std::filesystem::path failure_file(const std::filesystem::path& folder, std::uint64_t shard);

}  // namespace tendon::sweep
